"""Camera intrinsics in whatever file people have them."""
