"""The session on disk: a journal of every step, written before the step is announced, and a copy to restart from.

A session is a folder, `NAME.cocalib-session/`, with `journal.jsonl` (one line per step, only ever appended to),
`journal-copy.jsonl` (the same lines) and `lock` (held while a process has the session open). All of them are opened without
following links; every line carries a checksum, and both files are compared before anything is overwritten.
"""
