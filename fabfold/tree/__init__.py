"""Find the joint tree that carries the voxels into the template (paper section 4)."""
