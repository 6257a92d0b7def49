"""Parametric print-in-place hinges for build123d and CadQuery."""
