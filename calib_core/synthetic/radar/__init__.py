"""The simulated radar: what it resolves, how it scans, what it returns and what is wrong with it."""
