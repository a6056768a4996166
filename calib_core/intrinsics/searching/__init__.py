"""Search pictures for a board: in which order, which views are kept, and what they cover."""
