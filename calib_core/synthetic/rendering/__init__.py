"""Pictures: a traced backdrop that never moves, and in front of it the reflector and the person that carries it."""
