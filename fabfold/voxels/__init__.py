"""Choose the grid and cut the model into voxels (paper section 3)."""
