"""Checks of a solved fit: each returns no warnings if all is well, otherwise what is wrong and what to do."""
