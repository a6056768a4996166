"""`cocalib intrinsics`: calibrate a lens, and convert files with intrinsics."""
