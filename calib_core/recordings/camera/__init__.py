"""Camera messages: intrinsics, images and video."""
