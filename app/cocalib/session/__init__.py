"""What the user has done so far, as a value: Session, the events that change it, and the pure functions that apply them.

Nothing here deals with files, threads or screens.
"""
