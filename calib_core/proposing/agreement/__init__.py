"""Agreement: the mounting on which picture candidates and the radar agree, how far beyond chance, and what it says of each."""
