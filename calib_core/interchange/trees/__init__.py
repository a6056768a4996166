"""Frame trees of other tools' files: read, chained between radar and camera, and patched in place."""
