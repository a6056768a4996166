"""The page Check: what is beyond the rows of all pairs, which return one pair uses and why, two solutions side by side."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from calib_core.arrays import Values
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.check.agreement import compare
from calib_core.interchange.format import ImportedCalibration, imported
from calib_core.measurements import Candidate
from calib_core.results import Calibration, PairResult
from calib_core.results.calibration import CHI2_95_2
from calib_core.words.outcomes import said_of
from calib_core.words.text import Words, join, named, say, words
from cocalib.session.applying import History
from cocalib.view.model import Figure
from cocalib.view.wording import plain, sentence


class ReviewRow(msgspec.Struct, frozen=True, array_like=True):
    """What a review shows of one pair beyond its row; written as an array.

    Attributes:
        id: the click's id.
        influence: how far leaving it out moves the pose, in standard deviations; None if unknown.
        held_out_px: distance from the click to where the other pairs predict it; None if unknown.
    """

    id: str
    influence: float | None
    held_out_px: float | None


@dataclass(frozen=True, slots=True)
class Review:
    """The review of all pairs of an answer.

    Attributes:
        revision: of the session that the answer belongs to.
        rows: one per pair with a radar position.
        words: how the residuals compare with the noise model, and which pair the pose leans on most.
    """

    revision: int
    rows: tuple[ReviewRow, ...]
    words: Words


def review_of(calibration: Calibration | None, revision: int) -> Review:
    """Return the review of an answer; an empty one without a calibration."""
    if calibration is None or not calibration.pairs:
        return Review(revision, (), words("Available after the first calibration."))
    rows = tuple(
        ReviewRow(pair.id, _rounded(pair.influence, 3), _rounded(pair.held_out_px, 2)) for pair in calibration.pairs
    )
    return Review(revision, rows, _words(calibration))


def _rounded(value: float, digits: int) -> float | None:
    return round(value, digits) if np.isfinite(value) else None


def _words(calibration: Calibration) -> Words:
    pairs = [pair for pair in calibration.pairs if pair.inlier and np.isfinite(pair.expected_covariance_px2).all()]
    squared = [pair.residual_px @ np.linalg.solve(pair.expected_covariance_px2, pair.residual_px) for pair in pairs]
    said: list[Words | str] = ["This method has no noise model: no distribution is expected."]
    if pairs:
        inside, expected = sum(one <= CHI2_95_2 for one in squared), plain(0.95 * len(pairs))
        said = [f"{inside} of {len(pairs)} agreeing clicks are inside their 95 % ellipse ({expected} expected)."]
    influences = [(pair.influence, pair.id) for pair in calibration.pairs if np.isfinite(pair.influence)]
    if influences:
        most, name = max(influences)
        matters = "{pair} matters most: without it the pose moves {most} σ."
        said.append(say(matters, pair=named(name), most=plain(most, 2)))
    return join(said)


_MUCH_CLOSER = 3.0
"""From this ratio of distances on, the pose alone decides between two candidates."""


@dataclass(frozen=True, slots=True)
class PairReview:
    """One pair under the pose.

    Attributes:
        id: the click's id.
        why: which return it uses, and why this one.
        facts: figures about it.
    """

    id: str
    why: Words
    facts: tuple[Figure, ...] = ()


def pair_review(calibration: Calibration, name: str) -> PairReview:
    """Describe the pair of a click; if it has none, say so."""
    pair = next((pair for pair in calibration.pairs if pair.id == name), None)
    if pair is None:
        reason = next((str(said_of(row)) for row in calibration.unpaired if row.id == name), "not solved yet")
        return PairReview(name, say("{pair} has no radar position: {reason}.", pair=named(name), reason=reason))
    facts = _facts(pair)
    measured = pair.measured
    candidates = (*measured.candidates, *measured.set_aside) if measured is not None else ()
    if not candidates:
        kept = words("The radar positions that this pair could have used were not kept.")
        return PairReview(name, kept, facts)
    points = np.array([candidate.position_radar_m for candidate in candidates])
    distances_px = np.linalg.norm(calibration.reproject(points) - pair.pixel_px, axis=1)
    facts = (*facts, *_noise_fact(candidates[pair.candidate]))
    return PairReview(name, words(_why(pair, candidates, distances_px)), facts)


def _why(pair: PairResult, candidates: Sequence[Candidate], distances_px: Values) -> str:
    """Say what decided between the candidates."""
    chosen = pair.candidate
    used = f"the {np.linalg.norm(candidates[chosen].position_radar_m):.2f} m return"
    if pair.measured is not None and pair.measured.chosen is not None:
        return f"Uses {used}: chosen by hand, {plain(distances_px[chosen])} px from the click."
    if len(candidates) == 1:
        return f"Uses {used}: the only static one that stands out in its window."
    others = [i for i in range(len(candidates)) if i != chosen]
    near = min(others, key=lambda i: distances_px[i] if np.isfinite(distances_px[i]) else np.inf)
    best = max(others, key=lambda i: candidates[i].score)
    count, own_px, next_px = len(candidates), distances_px[chosen], distances_px[near]
    fits = own_px <= next_px or not np.isfinite(next_px)
    scores = candidates[chosen].score >= candidates[best].score
    away = f"{plain(own_px)} px from the click; the next is at {plain(next_px)} px"
    if not np.isfinite(own_px):
        return f"Uses {used} of {count}, though the camera would not see it there."
    if fits and scores:
        return f"Uses {used}: best of {count}, {away}."
    if fits:
        clear = "clearly " if next_px > _MUCH_CLOSER * own_px else ""
        return (
            f"Uses {used}: {clear}the nearest of {count}, {away}. The radar alone prefers the one at "
            f"{np.linalg.norm(candidates[best].position_radar_m):.2f} m."
        )
    nearest_m = np.linalg.norm(candidates[near].position_radar_m)
    return (
        f"Uses {used} of {count}, {plain(own_px)} px from the click. The one at {nearest_m:.2f} m is nearer "
        f"({plain(next_px)} px), but less plausible by the radar, or less certain."
    )


def _facts(pair: PairResult) -> tuple[Figure, ...]:
    return (
        Figure(
            "residual",
            "residual",
            *_with_unit(pair.distance_px, "px"),
            "Distance between the click and the reprojection under the pose.",
        ),
        Figure(
            "held_out",
            "leave-one-out",
            *_with_unit(pair.held_out_px, "px"),
            "The same under the pose that the other pairs give.",
        ),
        Figure(
            "outlier_probability",
            "outlier probability",
            *_with_unit(100.0 * pair.outlier_probability, "%", 2),
            "Probability that click and return do not belong together, by the other pairs.",
        ),
        Figure(
            "influence",
            "influence",
            *_with_unit(pair.influence, "sigma", 2),
            "How far leaving the pair out moves the pose, in standard deviations of the pose.",
        ),
    )


def _noise_fact(candidate: Candidate) -> tuple[Figure, ...]:
    """Return how uncertain a radar position is; nothing if it is not known."""
    if not np.isfinite(candidate.sigma_polar).all():
        return ()
    range_m, azimuth_rad, elevation_rad = candidate.sigma_polar.tolist()
    azimuth, elevation = (plain(np.degrees(angle), 2) for angle in (azimuth_rad, elevation_rad))
    hint = "One standard deviation of the radar position: range, azimuth, elevation."
    return (
        Figure("radar_noise", "radar noise", f"± {plain(100 * range_m, 2)} cm, {azimuth}°, {elevation}°", "", hint),
    )


def _with_unit(value: float, unit: str, digits: int = 3) -> tuple[str, str]:
    return (plain(value, digits), unit) if np.isfinite(value) else ("–", "")


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
    verdict = sentence(both.verdict)
    return Compared(revision, a.name, b.name, rows, verdict, tuple(_marks(a.calibration, b.calibration)))


def _marks(a: Calibration, b: Calibration) -> Iterator[ComparedMark]:
    """Yield one mark per pair of either; a solution without pairs, such as one from a file, draws those of the other."""
    of_a, of_b = _drawn_pixels(a, b), _drawn_pixels(b, a)
    for name in dict.fromkeys((*of_a, *of_b)):
        yield ComparedMark(name, of_a.get(name), of_b.get(name))


def _drawn_pixels(own: Calibration, other: Calibration) -> dict[str, tuple[float, float] | None]:
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
