"""The exception hierarchy. Each message says what was found, where, and what to do.

CalibrationError
 ├── RecordingError       a recording cannot be opened or read
 │    └── MessageError    one message, or one topic, cannot be decoded
 ├── InputError           one of our files (clicks, pairs, camera, calibration) is malformed
 │    └── NoAnswerError   everything was read, and holds nothing to answer from
 ├── OptionError          an option is misspelt or out of range
 └── UnsolvableError      a calibration was requested that the data cannot give
"""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from functools import singledispatch


class CalibrationError(Exception):
    """Any input this package rejects; the message is one line and can be shown as it is."""


class RecordingError(CalibrationError):
    """A recording that cannot be opened or read."""


class MessageError(RecordingError):
    """A message, or a whole topic, that cannot be decoded."""


class InputError(CalibrationError):
    """A file of clicks, pairs, camera or calibration that is malformed."""


class NoAnswerError(InputError):
    """Input that was read and holds nothing to answer from; the exit code is 1, not 2."""


class OptionError(CalibrationError):
    """An option that is misspelt, of the wrong type or out of range."""


@singledispatch
def in_words(value: object) -> str:
    """Return what a person is told of a value: its repr until `calib_core.words`, which knows how to say it, was imported."""
    return repr(value)


class UnsolvableError(CalibrationError):
    """A calibration was requested where the data do not determine one; raised by `Unsolvable.unwrap` only.

    Attributes:
        code: one word for programs, such as "too-few-pairs".
        outcome: the `Unsolvable`.
    """

    def __init__(self, code: str, outcome: object) -> None:
        super().__init__(code)
        self.code, self.outcome = code, outcome

    def __str__(self) -> str:
        return in_words(self)


def word_list(words: Sequence[str], conjunction: str = "and") -> str:
    """Return words as they are listed in a sentence: a, b and c."""
    *first, last = words
    return f"{', '.join(first)} {conjunction} {last}" if first else last


def meant(word: str, known: Iterable[str], these: str = "known:") -> str:
    """Return which known word an unknown one probably means, or else all that are known."""
    names = list(known)
    near = get_close_matches(word[:80], names, n=1) or get_close_matches(word[:80].lower(), names, n=1)
    return f"did you mean {near[0]}?" if near else f"{these} {', '.join(names)}"
