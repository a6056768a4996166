"""What watching sees: turns in traffic, in the still image and in still returns, how often it errs, and what it costs."""
