"""Faults tried, and what became of the user's work: the figures of docs/reliability.md."""
