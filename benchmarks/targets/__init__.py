"""How well the radar's own targets replace the truth in Acc, on recordings that were not used in development."""
