"""Cut printed bodies with hinges from the voxels (paper section 4.3)."""
