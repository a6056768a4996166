"""Checks of a solved fit: each says nothing when all is well, and otherwise what is wrong and what to do."""
