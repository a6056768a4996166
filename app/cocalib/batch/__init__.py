"""Many recordings: a manifest of sessions becomes a folder of results, resumable, on one machine or a cluster."""
