"""How well a lens is calibrated from pictures of a board, on draws that nobody chose."""
