"""What the screen shows, as a value: `view(session)` is pure, and every client draws the same View."""
