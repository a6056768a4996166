"""Damage session files in every way and count what an opening makes of them: `python -m benchmarks.reliability.sessions`.

An opening decides by `read_contents`. It refuses, or continues and says what was wrong, or continues without a word; the last is
silent if the session is not the one that was confirmed.
"""

import random
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from calib_core.measurements import TimeNs
from cocalib.session.applying import History, advance
from cocalib.session.events import ClickMoved, ClickPlaced, ClickRemoved, Step, Undo
from cocalib.session.file.contents import read_contents
from cocalib.session.file.guarded_folder import GuardedFolder, SessionFileError
from cocalib.session.file.journal import COPY, JOURNAL
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts

__all__ = ["Made", "every_bit", "every_kill", "every_length", "made_session", "sampled_bits"]

FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 33_333_333 * np.arange(4000), 1920, 1080)


@dataclass(frozen=True, slots=True)
class Made:
    """A session that was written and closed.

    Attributes:
        journal: its journal; the copy is the same.
        histories: the session after each step, the empty one first.
    """

    journal: bytes
    histories: tuple[History, ...]


def made_session(steps: int, folder: Path) -> Made:
    """Write a session of clicks, moves, removals and undone steps, and close it."""
    session_file = open_session_file(folder, FACTS)
    histories = [History()]
    for step in _steps(steps):
        history = advance(histories[-1], step, FACTS)
        session_file.append(step, history)
        histories.append(history)
    session_file.close()
    journal = (folder / JOURNAL).read_bytes()
    assert (folder / COPY).read_bytes() == journal
    return Made(journal, tuple(histories))


def every_bit(made: Made, folder: Path, *, name: str, with_other: bool = True, stride: int = 1) -> Counter[str]:
    """Flip every single bit of the journal or of its copy, or one in `stride`, and count what becomes of it."""
    return _flipped(made, folder, range(0, 8 * len(made.journal), stride), name=name, with_other=with_other)


def sampled_bits(made: Made, folder: Path, count: int, *, seed: int, with_other: bool) -> Counter[str]:
    """Flip single bits of the journal, drawn with a seed."""
    bits = random.Random(seed).sample(range(8 * len(made.journal)), count)
    return _flipped(made, folder, bits, name=JOURNAL, with_other=with_other)


def every_length(made: Made, folder: Path, *, name: str) -> Counter[str]:
    """Cut the journal or its copy at every length; the other one knows all steps."""
    lengths = range(len(made.journal))
    return Counter(
        _outcome(folder, {**_both(made), name: made.journal[:length]}, made.histories[-1]) for length in lengths
    )


def every_kill(made: Made, folder: Path) -> Counter[str]:
    """Stop the writing of every step at every byte, first in the journal, then in its copy."""
    found: Counter[str] = Counter()
    ends = [index + 1 for index, byte in enumerate(made.journal) if byte == ord("\n")]
    for number, (before, after) in enumerate(pairwise(ends)):
        for length in range(before, after + 1):
            torn = made.journal[:length]
            confirmed = made.histories[number + (length == after)]
            found[_outcome(folder, {JOURNAL: torn, COPY: made.journal[:before]}, confirmed)] += 1
            found[_outcome(folder, {JOURNAL: made.journal[:after], COPY: torn}, made.histories[number + 1])] += 1
    return found


def _both(made: Made) -> dict[str, bytes]:
    return {JOURNAL: made.journal, COPY: made.journal}


def _flipped(made: Made, folder: Path, bits: "range | list[int]", *, name: str, with_other: bool) -> Counter[str]:
    found: Counter[str] = Counter()
    for bit in bits:
        data = bytearray(made.journal)
        data[bit // 8] ^= 1 << bit % 8
        others = _both(made) if with_other else {}
        found[_outcome(folder, {**others, name: bytes(data)}, made.histories[-1])] += 1
    return found


def _outcome(folder: Path, files: dict[str, bytes], confirmed: History) -> str:
    """Return what an opening makes of a folder with these files."""
    folder.mkdir(exist_ok=True)
    for name in (JOURNAL, COPY):
        # a file that is cut and written again is flushed to the disk, which takes long
        (folder / name).unlink(missing_ok=True)
        if name in files:
            (folder / name).write_bytes(files[name])
    guarded = GuardedFolder(folder)
    try:
        found = read_contents(guarded, FACTS)
    except SessionFileError:
        return "refused"
    finally:
        guarded.close()
    assert found is not None
    if not found.is_complete:
        return "refused"
    if found.history != confirmed:
        return "silently changed"
    return "continued and told" if found.faults else "continued"


def _steps(count: int) -> Iterator[Step]:
    """Yield clicks, and now and then a move, a removal or an undo; each changes the session."""
    for number in range(count):
        clicks = number // 5 * 2 + min(number % 5, 2)
        kind = number % 5
        if kind < 2:
            yield ClickPlaced(
                TimeNs(int(FACTS.image_times[clicks])), (12.5 + number % 1900, 7.25 + number % 1000), "clicked"
            )
        elif kind == 2:
            yield ClickMoved(f"c{clicks}", (1.5 + number % 1900, 2.5 + number % 1000))
        elif kind == 3:
            yield ClickRemoved(f"c{clicks}")
        else:
            yield Undo()


def _main() -> None:
    with tempfile.TemporaryDirectory() as name:
        home = Path(name)
        short, long = made_session(12, home / "short"), made_session(300, home / "long")
        tried = home / "tried"
        rows = {
            "every fifth bit of a journal of 12 steps": every_bit(short, tried, name=JOURNAL, stride=5),
            "every fifth bit of its copy": every_bit(short, tried, name=COPY, stride=5),
            "every fifth bit of the journal, without its copy": every_bit(
                short, tried, name=JOURNAL, with_other=False, stride=5
            ),
            "300 bits of a journal of 300 steps": sampled_bits(long, tried, 300, seed=1, with_other=True),
            "the same, without its copy": sampled_bits(long, tried, 300, seed=2, with_other=False),
            "a journal of 12 steps cut at every length": every_length(short, tried, name=JOURNAL),
            "its copy cut at every length": every_length(short, tried, name=COPY),
            "a kill at every byte of 12 steps, in both": every_kill(short, tried),
        }
    columns = ("continued", "continued and told", "refused", "silently changed")
    print(f"| what | tried | {' | '.join(columns)} |\n|---|---|{'---|' * len(columns)}")
    for what, counts in rows.items():
        print(f"| {what} | {counts.total()} | {' | '.join(str(counts[column]) for column in columns)} |")


if __name__ == "__main__":
    _main()
