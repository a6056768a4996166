"""Damage session files in every way and count what an opening makes of them: `python -m benchmarks.reliability.sessions`.

An opening decides by `read_contents`. It refuses, or continues and says what was wrong, or continues without a word; the last is
silent if the session is not the one that was confirmed.
"""

import random
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from calib_core.measurements import TimeNs
from cocalib.session import ClickMoved, ClickPlaced, ClickRemoved, History, RecordingFacts, Step, Undo, advance
from cocalib.session.file import SessionFileError, open_session_file
from cocalib.session.file.guarded_folder import GuardedFolder
from cocalib.session.file.journal_reading import JOURNAL
from cocalib.session.file.reconciling import read_contents
from cocalib.session.file.snapshot import SNAPSHOT

__all__ = ["Made", "every_bit", "every_kill", "every_length", "made_session", "sampled_bits"]

FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 33_333_333 * np.arange(4000), 1920, 1080)


@dataclass(frozen=True, slots=True)
class Made:
    """A session that was written and closed.

    Attributes:
        journal: its journal.
        snapshot: its snapshot.
        histories: the session after each step, the empty one first.
        snapshots: the snapshot that was on the disk after each step; None before the first.
    """

    journal: bytes
    snapshot: bytes
    histories: tuple[History, ...]
    snapshots: tuple[bytes | None, ...]


def made_session(steps: int, folder: Path) -> Made:
    """Write a session of clicks, moves, removals and undone steps, and close it."""
    session_file = open_session_file(folder, FACTS)
    histories, snapshots = [History()], [_snapshot(folder)]
    for step in _steps(steps):
        history = advance(histories[-1], step, FACTS)
        session_file.append(step, history)
        histories.append(history)
        snapshots.append(_snapshot(folder))
    session_file.close()
    return Made((folder / JOURNAL).read_bytes(), (folder / SNAPSHOT).read_bytes(), tuple(histories), tuple(snapshots))


def every_bit(made: Made, folder: Path, *, name: str, with_snapshot: bool = True, stride: int = 1) -> Counter[str]:
    """Flip every single bit of the journal or of the snapshot, or one in `stride`, and count what becomes of it."""
    bits = range(0, 8 * len(made.journal if name == JOURNAL else made.snapshot), stride)
    return _flipped(made, folder, bits, name=name, with_snapshot=with_snapshot)


def sampled_bits(made: Made, folder: Path, count: int, *, seed: int, with_snapshot: bool) -> Counter[str]:
    """Flip single bits of the journal, drawn with a seed."""
    bits = random.Random(seed).sample(range(8 * len(made.journal)), count)
    return _flipped(made, folder, bits, name=JOURNAL, with_snapshot=with_snapshot)


def every_length(made: Made, folder: Path) -> Counter[str]:
    """Cut the journal of a closed session at every length; its snapshot knows all steps."""
    lengths = range(len(made.journal))
    return Counter(_outcome(folder, made.journal[:length], made.snapshot, made.histories[-1]) for length in lengths)


def every_kill(made: Made, folder: Path) -> Counter[str]:
    """Stop the writing of every step at every byte, with the snapshot before and after its own writing."""
    found: Counter[str] = Counter()
    for length in range(made.journal.index(b"\n") + 1, len(made.journal) + 1):
        whole = made.journal[:length].count(b"\n") - 1
        for snapshot in dict.fromkeys((made.snapshots[max(0, whole - 1)], made.snapshots[whole])):
            found[_outcome(folder, made.journal[:length], snapshot, made.histories[whole])] += 1
    return found


def _flipped(made: Made, folder: Path, bits: "range | list[int]", *, name: str, with_snapshot: bool) -> Counter[str]:
    found: Counter[str] = Counter()
    for bit in bits:
        data = bytearray(made.journal if name == JOURNAL else made.snapshot)
        data[bit // 8] ^= 1 << bit % 8
        journal, snapshot = (bytes(data), made.snapshot) if name == JOURNAL else (made.journal, bytes(data))
        found[_outcome(folder, journal, snapshot if with_snapshot else None, made.histories[-1])] += 1
    return found


def _outcome(folder: Path, journal: bytes, snapshot: bytes | None, confirmed: History) -> str:
    """Return what an opening makes of two files."""
    folder.mkdir(exist_ok=True)
    for name, data in ((JOURNAL, journal), (SNAPSHOT, snapshot)):
        (folder / name).unlink(
            missing_ok=True
        )  # a file that is cut and written again is flushed to the disk, which takes long
        if data is not None:
            (folder / name).write_bytes(data)
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
    present, expected = found.history.present, confirmed.present
    if (present.clicks, present.options) != (expected.clicks, expected.options):
        return "silently changed"
    return "continued and told" if found.faults else "continued"


def _snapshot(folder: Path) -> bytes | None:
    path = folder / SNAPSHOT
    return path.read_bytes() if path.exists() else None


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
            "every bit of a journal of 12 steps, closed": every_bit(short, tried, name=JOURNAL),
            "the same, killed before its first snapshot": every_bit(short, tried, name=JOURNAL, with_snapshot=False),
            "every bit of its snapshot": every_bit(short, tried, name=SNAPSHOT),
            "3000 bits of a journal of 300 steps, closed": sampled_bits(long, tried, 3000, seed=1, with_snapshot=True),
            "the same, without its snapshot": sampled_bits(long, tried, 3000, seed=2, with_snapshot=False),
            "a journal of 12 steps cut at every length": every_length(short, tried),
            "a kill at every byte of 12 steps": every_kill(short, tried),
        }
    columns = ("continued", "continued and told", "refused", "silently changed")
    print(f"| what | tried | {' | '.join(columns)} |\n|---|---|{'---|' * len(columns)}")
    for what, counts in rows.items():
        print(f"| {what} | {counts.total()} | {' | '.join(str(counts[column]) for column in columns)} |")


if __name__ == "__main__":
    _main()
