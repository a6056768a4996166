"""Files of manifests: TOML and CSV are read, and a first one is written from a folder of recordings."""
