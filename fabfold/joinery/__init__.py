"""Cut printed bodies with hinges from the voxels (paper section 4.3).

:func:`fabfold.joinery.build.build_bodies` is the way in. It calls the other modules in this order:

- ``sizes``, ``hinge_placement``: the size of the hinges, and their solids on the lattice edges;
- ``barrel_sweeps``, ``grooves``, ``pockets``: how barrels and link plates pass other bodies on the
  folding path, and the tools that make room for them;
- ``carving``, ``polar_slices``: room for cells that run into each other on the path;
- ``cells``, ``booleans``, ``cutting``: the cells of a body as a solid, and the cuts;
- ``links``: link plates of double hinges as bodies;
- ``one_piece``, ``struts``: struts where the cut left a body in pieces;
- ``soundness``: the final mesh.

``bodies`` holds the result, and ``tally`` counts what was taken away and added.
"""
