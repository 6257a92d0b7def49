"""Load a model and make one closed manifold of it."""
