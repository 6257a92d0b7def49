"""Find and certify the folding path (paper section 5)."""
