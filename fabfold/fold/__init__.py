"""Find the folding path: the order in which hinges turn so that bodies never collide (section 5).

* :mod:`fabfold.fold.lattice_planner` is the door: it plans a hinge system's path, and tells which
  hinges can never turn. :mod:`fabfold.fold.lattice_foldability` answers the tree search with it.
* The kernels behind it: :mod:`fabfold.fold.mechanism` and :mod:`fabfold.fold.scene` (what folds,
  and where it is), :mod:`fabfold.fold.turn_obstacles` (what a turn runs into),
  :mod:`fabfold.fold.closure_test`, :mod:`fabfold.fold.bidirectional_search` with its
  :mod:`fabfold.fold.open_list`, and :mod:`fabfold.fold.shortcut`.
* Carving: :mod:`fabfold.fold.core_sweep` (paths for the cores of cells),
  :mod:`fabfold.fold.clashes` and :mod:`fabfold.fold.carving_plan` (which cells give way).
* :mod:`fabfold.fold.motion` holds the path as keyframes. Before anything is cut,
  :mod:`fabfold.fold.barrel_collisions` looks at the barrels on it, and
  :mod:`fabfold.fold.crease_hinges` adds the folds of a template with creases.
"""
