"""What an answer is worth: checks of a solved fit, each of which returns no warnings if all is well, and the next placement."""
