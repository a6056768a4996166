"""Lens models: how each projects and what other software calls it, one module per family; `registry` lists them."""
