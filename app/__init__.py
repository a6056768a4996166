"""The application: command line, server, session."""
