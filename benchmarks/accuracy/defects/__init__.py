"""With the errors that real radars, lenses, scenes and people have: is the stated uncertainty right, and the cause named?"""
