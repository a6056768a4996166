"""How well the machine proposes where the reflector stands in the pictures, on recordings that nobody chose."""
