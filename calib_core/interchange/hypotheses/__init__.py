"""Numbers that can be a pose, in files that do not state what they mean: each meaning is a hypothesis, and a person picks one."""
