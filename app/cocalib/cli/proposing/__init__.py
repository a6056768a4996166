"""`cocalib propose`, and what `cocalib solve --auto` shares with it."""
