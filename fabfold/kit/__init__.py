"""A kit: the stages from a model to print-ready files."""
