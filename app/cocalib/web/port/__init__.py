"""The server's single port: access control, responses, and startup."""
