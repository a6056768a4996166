"""What is known of a fleet from the results of its sessions: index, history, comparison, summary page."""
