"""Write the files of a kit from its printed bodies.

There is a module for each file: ``stl``, ``threemf``, ``step``, ``glb`` (the animation),
``kit_picture`` and ``report``. ``weld`` keeps meshes closed in the precision of a file. Pictures
are drawn by ``render`` with ``camera``, ``lighting``, ``raster`` and ``shading``; ``sketch`` draws
a tree that is not built yet. STEP faces come from ``surfaces``, ``body_brep``, ``thin`` and
``steptext``.
"""
