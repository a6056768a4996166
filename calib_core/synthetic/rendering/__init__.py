"""Rendering: a static ray-traced backdrop with the reflector and the person in front of it."""
