"""Files of manifests: TOML is read, and a first one is written from a folder of recordings."""
