"""The clocks of a recording, and parsing and formatting of times."""
