"""How well a lens is calibrated from images of a board, on draws that nobody chose."""
