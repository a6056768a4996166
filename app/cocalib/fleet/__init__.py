"""What is known of a fleet from the results of its sessions: index, history, prior, summary page."""
