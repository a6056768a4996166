"""Camera intrinsics from the file formats in common use."""
