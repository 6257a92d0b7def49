"""Built-in models, drawn with build123d."""
