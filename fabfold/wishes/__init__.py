"""What a maker may wish for, as terms of the search."""
