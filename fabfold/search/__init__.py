"""Search for trees that fold, with many seeds."""
