"""The tree of errors. Each says what was found, where, and what to do.

CalibrationError
 ├── RecordingError       a recording cannot be opened or read
 │    └── MessageError    one message, or one topic, cannot be decoded
 ├── InputError           a file of ours (clicks, pairs, camera, calibration) is malformed
 ├── OptionError          an option is misspelt or out of range
 └── UnsolvableError      an answer was asked for where the data give none
"""

__all__ = ["CalibrationError", "InputError", "MessageError", "OptionError", "RecordingError", "UnsolvableError"]


class CalibrationError(Exception):
    """Any input this package refuses; the text is made to be shown as it is, in one line."""


class RecordingError(CalibrationError):
    """A recording that cannot be opened or read."""


class MessageError(RecordingError):
    """A message, or all of a topic, that cannot be decoded."""


class InputError(CalibrationError):
    """A file of clicks, pairs, camera or calibration that is malformed."""


class OptionError(CalibrationError):
    """An option that is misspelt, of the wrong type or out of range."""


class UnsolvableError(CalibrationError):
    """A calibration was asked for where the data give none; raised by `Unsolvable.unwrap` only."""
