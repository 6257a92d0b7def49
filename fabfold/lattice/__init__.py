"""The cubic lattice: rotations, templates, swept cells."""
