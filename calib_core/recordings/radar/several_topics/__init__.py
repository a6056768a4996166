"""Several topics of one radar, read as one."""
