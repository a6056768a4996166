"""Two solutions side by side: their difference as figures, and where each draws the pairs."""

from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np

from calib_core.interchange import CalibrationFile, ImportedCalibration, compare, imported
from calib_core.results import Calibration
from cocalib.session import History
from cocalib.view.wording import sentence


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """One of the two.

    Attributes:
        name: for display.
        found: the calibration as it is compared.
        calibration: the same with the recording's camera, as it is drawn.
    """

    name: str
    found: ImportedCalibration
    calibration: Calibration


class ComparedMark(msgspec.Struct, frozen=True, array_like=True):
    """Where both solutions draw the radar position of one pair; written as an array.

    Attributes:
        id: the click's id.
        a_px: (u, v) under A; None if A's camera does not see it.
        b_px: (u, v) under B.
    """

    id: str
    a_px: tuple[float, float] | None
    b_px: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class ComparedRow:
    """One figure of the comparison, as `cocalib check --against` prints it.

    Attributes:
        label: what differs.
        text: by how much.
    """

    label: str
    text: str


@dataclass(frozen=True, slots=True)
class Compared:
    """Two solutions compared.

    Attributes:
        revision: of the session they belong to.
        a: name of the first.
        b: name of the second.
        rows: how far they are apart; empty with a problem.
        verdict: whether that exceeds what they state about themselves.
        marks: where each draws the pairs.
        problem: why there is nothing to compare; "" otherwise.
    """

    revision: int
    a: str
    b: str
    rows: tuple[ComparedRow, ...] = ()
    verdict: str = ""
    marks: tuple[ComparedMark, ...] = ()
    problem: str = ""


def solution_of(name: str, calibration: Calibration) -> Solution:
    """Return a calibration that was solved here as one of two solutions."""
    return Solution(name, imported(CalibrationFile(calibration)), calibration)


def not_compared(revision: int, a: str, b: str, problem: str) -> Compared:
    """Say why there is nothing to compare."""
    return Compared(revision, a, b, problem=sentence(problem))


def compared(revision: int, a: Solution, b: Solution) -> Compared:
    """Compare two solutions: the figures are those of `cocalib check B --against A`."""
    both = compare(a.found, b.found, camera=a.calibration.camera)
    rows = tuple(ComparedRow(figure.label, figure.text) for figure in both.figures)
    verdict = sentence(both.verdict("A", "B"))
    return Compared(revision, a.name, b.name, rows, verdict, tuple(_marks(a.calibration, b.calibration)))


def _marks(a: Calibration, b: Calibration) -> Iterator[ComparedMark]:
    """Yield one mark per pair of either; a solution without pairs, such as one from a file, draws those of the other."""
    of_a, of_b = _drawn(a, b), _drawn(b, a)
    for name in dict.fromkeys((*of_a, *of_b)):
        yield ComparedMark(name, of_a.get(name), of_b.get(name))


def _drawn(own: Calibration, other: Calibration) -> dict[str, tuple[float, float] | None]:
    pairs = own.pairs or other.pairs
    if not pairs:
        return {}
    if own.pairs:
        pixels = np.array([pair.projected_px for pair in pairs])
    else:
        pixels = own.reproject(np.array([pair.point_radar_m for pair in pairs]))
    return {pair.id: _pixel(u_px, v_px) for pair, (u_px, v_px) in zip(pairs, pixels.tolist(), strict=True)}


def _pixel(u_px: float, v_px: float) -> tuple[float, float] | None:
    return (round(u_px, 2), round(v_px, 2)) if np.isfinite(u_px) and np.isfinite(v_px) else None


def previous_calibration(history: History) -> Calibration | None:
    """Return the answer before the present one, looking back through what can be undone; None if there was none."""
    now = history.present.outcome
    for session in reversed(history.past):
        outcome = session.outcome
        if isinstance(outcome, Calibration) and outcome is not now and not outcome.checking:
            return outcome
    return None
