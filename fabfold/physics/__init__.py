"""Unfolding A and B in a physics simulator until they meet: the paper's section 5, in MuJoCo."""
