"""What is known of a fleet from the results of its sessions: status, history, comparison, summary page."""
