"""How well the machine proposes where the reflector stands in the images, on recordings that nobody chose."""
