"""Readers of joints, one file per kind of file."""
