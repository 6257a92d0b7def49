"""The cubic lattice: its 24 rotations, target shapes, and what a quarter turn sweeps."""
