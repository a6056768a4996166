"""Following boxes through the pictures of a recording."""
