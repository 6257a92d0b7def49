"""Write the files of a kit."""
