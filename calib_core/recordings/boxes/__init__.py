"""Topics of boxes around objects: found by their fields, decoded, and matched to recorded frames by their stamps."""
