"""One file per kind of message: how its returns are laid out."""
