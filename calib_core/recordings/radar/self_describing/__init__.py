"""Read radar messages that no registry knows by what they say about themselves: names, comments and values."""
