"""The calibration formats of other tools, each with writer and reader in one module, and their registry."""
