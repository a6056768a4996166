"""Lens models: their projections and their names in other software, one module per family; `registry` lists them."""
