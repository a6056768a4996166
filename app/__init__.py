"""What touches a person: command line, server, session."""
