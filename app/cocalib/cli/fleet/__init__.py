"""The commands for many vehicles."""
