"""Coverage-guided fuzzing: inputs that reach new lines join the corpus; what a target must never do is a finding."""

import hashlib
import random
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from calib_core.errors import CalibrationError
from tests.fuzz.mutation import mutated
from tests.fuzz.reached_lines import ReachedLines

PATIENCE_S = 30.0
"""An input that takes longer is a finding: a hang."""


@dataclass(frozen=True, slots=True)
class Target:
    """Code that reads what a stranger may have written.

    Attributes:
        name: of the target and its folder in the corpus.
        run: reads the input; it may raise CalibrationError and nothing else. Files go into the given folder.
        seeds: valid and known bad inputs to begin with, given an empty folder to build them in.
        tokens: words of the input's language.
        longest_bytes: of an input.
    """

    name: str
    run: Callable[[bytes, Path], None]
    seeds: Callable[[Path], Sequence[bytes]]
    tokens: tuple[bytes, ...] = ()
    longest_bytes: int = 1 << 18


@dataclass(frozen=True, slots=True)
class Finding:
    """An input that did what none may, and the traceback or the complaint."""

    data: bytes
    what: str

    @property
    def name(self) -> str:
        """A short name for the input."""
        return hashlib.sha256(self.data).hexdigest()[:12]


@dataclass(slots=True)
class Report:
    """What a run came to.

    Attributes:
        tried: number of inputs.
        lines: lines of our code that were reached.
        corpus: all inputs that reached something new.
        added: those of them that were not there before.
        findings: at most one per place in the code.
    """

    tried: int = 0
    lines: int = 0
    corpus: list[bytes] = field(default_factory=list)
    added: list[bytes] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


class _TookTooLongError(Exception):
    """The input was not read in time."""


@contextmanager
def _patience(seconds: float) -> Iterator[None]:
    """Interrupt the block if it takes too long, where the system can: in the main thread, not on Windows."""
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def too_long(_signal: int, _frame: object) -> None:
        raise _TookTooLongError(f"not read within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, too_long)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def offence(target: Target, data: bytes, folder: Path) -> str:
    """Run a target on one input; return what it did that it must not, "" if nothing."""
    try:
        with _patience(PATIENCE_S):
            target.run(data, folder)
    except CalibrationError as error:
        return "" if str(error).strip() else "an error without a message"
    except Exception as error:  # noqa: BLE001  what is not foreseen is what a fuzzer looks for
        return "".join(traceback.format_exception(error))
    return ""


def fuzz(
    target: Target,
    corpus: Sequence[bytes],
    folder: Path,
    *,
    rng: random.Random,
    go_on: Callable[[Report], bool],
    lines: ReachedLines | None = None,
) -> Report:
    """Fuzz a target.

    Args:
        target: what to fuzz.
        corpus: inputs of earlier runs.
        folder: an empty folder for the target's files.
        rng: the source of randomness; the same one gives the same run.
        go_on: whether to try another input, given the report so far.
        lines: what counts as reached; all of calib_core and cocalib by default.
    """
    lines = lines or ReachedLines()
    report = Report()
    seeds_folder = folder / "seeds"
    seeds_folder.mkdir()
    known = [seed[: target.longest_bytes] for seed in (*target.seeds(seeds_folder), *corpus)]
    places: set[str] = set()
    for number, data in enumerate(known):
        _try(target, data, folder, lines, report, places)
        report.corpus.append(data) if lines.new or number == 0 else None
    while go_on(report):
        newest = report.corpus[-8:]  # what reached something new last is the most promising
        parent = rng.choice(newest if rng.random() < 0.4 else report.corpus)
        data = mutated(parent, report.corpus, target.tokens, rng, target.longest_bytes)
        _try(target, data, folder, lines, report, places)
        if lines.new:
            report.corpus.append(data)
            report.added.append(data)
    report.lines = len(lines.seen)
    return report


def _try(target: Target, data: bytes, folder: Path, lines: ReachedLines, report: Report, places: set[str]) -> None:
    report.tried += 1
    with lines:
        what = offence(target, data, folder)
    if what and (place := _place(what)) not in places:
        places.add(place)
        report.findings.append(Finding(data, what))


def _place(what: str) -> str:
    """Return what tells findings apart: the innermost line of the traceback and the error."""
    at = [line for line in what.splitlines() if line.lstrip().startswith("File ")]
    return (at[-1] if at else "") + what.strip().splitlines()[-1].partition(":")[0]
