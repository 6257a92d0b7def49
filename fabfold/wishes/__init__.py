"""What a maker can ask for beyond a box that folds, each wish as a term of the tree search."""
