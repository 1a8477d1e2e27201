"""What to simulate: the table of parameters and the scene files that set them."""
