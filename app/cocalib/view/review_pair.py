"""Which return a pair uses and why: all its candidates under the pose, with what speaks for each."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from calib_core.measurements import Candidate
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration, PairResult
from cocalib.view.direction import direction_words
from cocalib.view.number_format import plain

_MUCH_CLOSER = 3.0
"""From this ratio of distances on, the pose alone decides between two candidates."""


@dataclass(frozen=True, slots=True)
class PairFact:
    """One line about a pair, as final text.

    Attributes:
        label: what it is.
        value: with its unit.
        hint: one sentence that explains it, shown on hover.
    """

    label: str
    value: str
    hint: str


@dataclass(frozen=True, slots=True)
class ReviewedReturn:
    """One radar position that may be the reflector, as final text.

    Attributes:
        chosen: the pair uses it.
        range: from the radar.
        direction: azimuth and elevation in words.
        score: plausibility before any pose is known.
        snr: mean of its returns; a dash if the radar reports none.
        seen: how many returns it averages, and from how many scans.
        distance: from the click to its reprojection.
        u_px: column of its reprojection; None if the camera does not see it.
        v_px: row of its reprojection.
    """

    chosen: bool
    range: str
    direction: str
    score: str
    snr: str
    seen: str
    distance: str
    u_px: float | None
    v_px: float | None


@dataclass(frozen=True, slots=True)
class PairReview:
    """One pair under the pose.

    Attributes:
        id: the click's id.
        why: which return it uses, and why this one.
        facts: figures about it.
        candidates: the most plausible first; empty if they were not kept.
    """

    id: str
    why: str
    facts: tuple[PairFact, ...] = ()
    candidates: tuple[ReviewedReturn, ...] = ()


def pair_review(calibration: Calibration, name: str) -> PairReview:
    """Describe the pair of a click; if it has none, say so."""
    pair = next((pair for pair in calibration.pairs if pair.id == name), None)
    if pair is None:
        reason = next((f"{row.reason}; {row.hint}" for row in calibration.unpaired if row.id == name), "not solved yet")
        return PairReview(name, f"{name} has no radar position: {reason}.")
    facts = _facts(pair)
    measured = pair.measured
    candidates = (*measured.candidates, *measured.set_aside) if measured is not None else ()
    if not candidates:
        return PairReview(name, "The radar positions that this pair could have used were not kept.", facts)
    points = np.array([candidate.position_radar_m for candidate in candidates])
    pixels = calibration.reproject(points)
    distances_px = np.linalg.norm(pixels - pair.pixel_px, axis=1)
    rows = tuple(
        _row(candidate, pixel, float(distance_px), chosen=i == pair.candidate)
        for i, (candidate, pixel, distance_px) in enumerate(zip(candidates, pixels, distances_px, strict=True))
    )
    facts = (*facts, *_noise_fact(candidates[pair.candidate]))
    return PairReview(name, _why(pair, candidates, distances_px), facts, rows)


def _row(candidate: Candidate, pixel: Values, distance_px: float, *, chosen: bool) -> ReviewedReturn:
    range_m, azimuth, elevation = polar_from_cartesian(candidate.position_radar_m[None])[0].tolist()
    side, height = direction_words(math.degrees(azimuth), "left", "right"), math.degrees(elevation)
    seen = bool(np.isfinite(pixel).all())
    return ReviewedReturn(
        chosen=chosen,
        range=f"{range_m:.2f} m",
        direction=f"{side}, {direction_words(height, 'up', 'down')}",
        score=plain(candidate.score, 2),
        snr=f"{candidate.snr_db:.0f} dB" if np.isfinite(candidate.snr_db) else "–",
        seen=f"{candidate.returns} in {candidate.scans}",
        distance=f"{plain(distance_px)} px" if np.isfinite(distance_px) else "not in the picture",
        u_px=round(float(pixel[0]), 2) if seen else None,
        v_px=round(float(pixel[1]), 2) if seen else None,
    )


def _why(pair: PairResult, candidates: Sequence[Candidate], distances_px: Values) -> str:
    """Say what decided between the candidates."""
    chosen = pair.candidate
    place = f"{np.linalg.norm(candidates[chosen].position_radar_m):.2f} m"
    if pair.measured is not None and pair.measured.chosen is not None:
        return f"Uses the return at {place} because it was chosen by hand, {plain(distances_px[chosen])} px from the click."
    if len(candidates) == 1:
        return f"Uses the return at {place}, the only static one that stands out in its window."
    others = [i for i in range(len(candidates)) if i != chosen]
    near = min(others, key=lambda i: distances_px[i] if np.isfinite(distances_px[i]) else np.inf)
    best = max(others, key=lambda i: candidates[i].score)
    count, own_px, next_px = len(candidates), distances_px[chosen], distances_px[near]
    fits = own_px <= next_px or not np.isfinite(next_px)
    scores = candidates[chosen].score >= candidates[best].score
    away = f"{plain(own_px)} px from the click under the pose, the next {plain(next_px)} px"
    if not np.isfinite(own_px):
        return f"Uses the return at {place} of {count} candidates, though the camera would not see it there."
    if fits and scores:
        return f"Uses the return at {place} of {count} candidates: the most plausible by the radar, and {away}."
    if fits:
        clear = "clearly " if next_px > _MUCH_CLOSER * own_px else ""
        return (
            f"Uses the return at {place} of {count} candidates: it is {clear}the nearest ({away}), though the radar alone "
            f"prefers the one at {np.linalg.norm(candidates[best].position_radar_m):.2f} m."
        )
    nearest_m = np.linalg.norm(candidates[near].position_radar_m)
    return (
        f"Uses the return at {place} of {count} candidates, {plain(own_px)} px from the click; the one at {nearest_m:.2f} m is "
        f"nearer ({plain(next_px)} px), but less plausible by the radar, or less certain."
    )


def _facts(pair: PairResult) -> tuple[PairFact, ...]:
    return (
        PairFact("residual", _px(pair.distance_px), "Distance between the click and the reprojection under the pose."),
        PairFact("held out", _px(pair.held_out_px), "The same under the pose that the other pairs give."),
        PairFact(
            "outlier probability",
            f"{plain(100.0 * pair.outlier_probability, 2)} %" if np.isfinite(pair.outlier_probability) else "–",
            "Probability that click and return do not belong together, judged by the other pairs.",
        ),
        PairFact(
            "influence",
            f"{plain(pair.influence, 2)} sigma" if np.isfinite(pair.influence) else "–",
            "How far leaving the pair out moves the pose, in standard deviations of the pose.",
        ),
    )


def _noise_fact(candidate: Candidate) -> tuple[PairFact, ...]:
    """Return how uncertain a radar position is; nothing if it is not known."""
    if not np.isfinite(candidate.sigma_polar).all():
        return ()
    range_m, azimuth_rad, elevation_rad = candidate.sigma_polar.tolist()
    azimuth, elevation = (plain(np.degrees(angle), 2) for angle in (azimuth_rad, elevation_rad))
    hint = "One standard deviation of the radar position: range, azimuth, elevation."
    return (PairFact("radar noise", f"± {plain(100 * range_m, 2)} cm, {azimuth}°, {elevation}°", hint),)


def _px(length_px: float) -> str:
    return f"{plain(length_px)} px" if np.isfinite(length_px) else "–"
