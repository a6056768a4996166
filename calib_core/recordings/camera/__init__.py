"""Read camera messages: intrinsics, images and video."""
