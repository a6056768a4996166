"""The clocks of a recording, and times as people write them."""
