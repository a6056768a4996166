"""Code that is written into every pack and runs there without cocalib; nothing in this program imports it."""
