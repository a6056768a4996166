"""The one list of reflectors seen: what became of each placement, which clicks are of it, and which are hardly the reflector."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.arrays import Flags, Points2, Points3
from calib_core.association.placements import Placement
from calib_core.estimation.pair_results import reprojection_covariances
from calib_core.measurements import ReflectorClick
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration
from calib_core.results.calibration import CHI2_999_2
from calib_core.results.verdict import verdict_on
from cocalib.session.state import Session
from cocalib.view.model import PlacementState

_SAME_M = 0.5
"""Positions of one placement differ less than this between two surveys of a recording [m]."""
_APART_M, _ASIDE_M = 0.75, 1.5
"""A return that differs this much in range, or across the line of sight, is another target: the reflector's own scatter less."""
_OTHER_TARGET = 2.0
_ON_MARK = 0.5
"""A spot this close to a mark shows what is marked, in widths of the reflector."""


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """What the images show of a placement.

    Attributes:
        pixels_px: (k, 2) of the places that changed while it stood.
        width_px: of the reflector at its range.
    """

    pixels_px: Points2
    width_px: float


@dataclass(frozen=True, slots=True, eq=False)
class SeenPlacements:
    """The placements, and what the images show of them.

    Attributes:
        placements: found in the radar data.
        spots: of those whose images were looked at, by number.
    """

    placements: tuple[Placement, ...] = ()
    spots: Mapping[int, Spots] = field(default_factory=dict)


def placements_of_clicks(session: Session, placements: Sequence[Placement]) -> dict[str, int]:
    """Return the number of each click's placement, by id; -1 if it is of none, or that is not known yet.

    Of several at one time, its radar position tells.
    """
    times = np.array([click.image_time for click in session.clicks], dtype=np.int64)
    starts, ends = (np.array([int(getattr(one, end)) for one in placements]) for end in ("start", "end"))
    during: Flags = (
        (times[:, None] >= starts) & (times[:, None] <= ends) if placements else np.zeros((len(times), 0), bool)
    )
    positions = _positions(session)
    return {
        click.id: _nearest(np.flatnonzero(here).tolist(), placements, positions.get(click.id))
        for click, here in zip(session.clicks, during, strict=True)
    }


def _positions(session: Session) -> dict[str, Points3]:
    outcome = session.outcome
    if isinstance(outcome, Calibration):
        return {pair.id: pair.point_radar_m for pair in outcome.pairs}
    return {} if outcome is None else {pair.id: pair.candidates[0].position_radar_m for pair in outcome.pairs}


def _nearest(here: list[int], placements: Sequence[Placement], position_m: Points3 | None) -> int:
    if len(here) < 2:
        return here[0] if here else -1
    if position_m is None:
        return -1
    polar = polar_from_cartesian(np.array([position_m, *(placements[i].position_radar_m for i in here)]))
    away = polar[1:] - polar[0]
    apart = np.hypot(away[:, 0] / _APART_M, away[:, 1] * polar[1:, 0] / _ASIDE_M)
    best = int(np.argmin(apart))
    return here[best] if apart[best] < _OTHER_TARGET else -1


def is_dismissed(placement: Placement, session: Session) -> bool:
    """Return whether the user said that a placement is not the reflector."""
    at = [one for one in session.dismissed if placement.start <= one.time <= placement.end]
    return any(float(np.linalg.norm(placement.position_radar_m - one.position_m)) < _SAME_M for one in at)


def placement_states(
    session: Session, seen: SeenPlacements, of_clicks: Mapping[str, int]
) -> tuple[PlacementState, ...]:
    """Return what became of each placement.

    Before a usable verdict nothing leaves the list; what left comes back when the pose moves.

    Args:
        session: with its clicks, and what was dismissed.
        seen: the placements.
        of_clicks: the number of each click's placement, by id.
    """
    looked_at = {of_clicks[click.id] for click in session.clicks if click.counts or click.excluded}
    guessed = set(of_clicks.values()) - looked_at
    states: list[PlacementState] = [
        "dismissed"
        if is_dismissed(placement, session)
        else "marked"
        if i in looked_at
        else "guess"
        if i in guessed
        else "open"
        for i, placement in enumerate(seen.placements)
    ]
    for i in _unlikely(session, seen, [i for i, state in enumerate(states) if state == "open"]):
        states[i] = "unlikely"
    return tuple(states)


def _unlikely(session: Session, seen: SeenPlacements, numbers: list[int]) -> list[int]:
    """Return which of some placements the camera does not see under a usable pose, or shows nothing of that was put down."""
    outcome = session.outcome
    if not numbers or not isinstance(outcome, Calibration) or verdict_on(outcome).level not in ("good", "usable"):
        return []
    positions = np.array([seen.placements[i].position_radar_m for i in numbers])
    pixels = outcome.reproject(positions)
    covariances = reprojection_covariances(outcome, positions)
    size = np.array([outcome.camera.width_px, outcome.camera.height_px])
    return [
        i
        for i, pixel, covariance in zip(numbers, pixels, covariances, strict=True)
        if not np.isfinite(pixel).all()
        or not _within(np.clip(pixel, 0, size - 1.0)[None] - pixel, covariance)
        or (i in seen.spots and not _within(_left(session, seen, i) - pixel, covariance))
    ]


def _left(session: Session, seen: SeenPlacements, number: int) -> Points2:
    """Return the spots (k, 2) of a placement that no mark is on."""
    spots = seen.spots[number]
    return spots.pixels_px[unmarked(spots, seen.placements[number], session.clicks)]


def _within(away_px: Points2, covariance_px2: Points2) -> bool:
    """Return whether any of some distances (k, 2) is one that 999 of 1000 right ones do not exceed."""
    squared = np.einsum("ki,ij,kj->k", away_px, np.linalg.pinv(covariance_px2), away_px)
    return bool((squared <= CHI2_999_2).any())


def unmarked(spots: Spots, placement: Placement, clicks: Sequence[ReflectorClick]) -> Flags:
    """Return which spots (k,) of a placement no mark of its time is on."""
    marks = [
        (click.u_px, click.v_px)
        for click in clicks
        if click.counts and placement.start <= click.image_time <= placement.end
    ]
    away_px = spots.pixels_px[:, None] - np.array(marks, dtype=np.float64).reshape(1, -1, 2)
    return np.asarray((np.linalg.norm(away_px, axis=2) > _ON_MARK * spots.width_px).all(axis=1))
