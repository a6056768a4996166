"""The radar returns that may belong to a click: where each is, how well it fits, and between which a person is to choose."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.estimation.pair_results import CandidateFit, candidate_fits
from calib_core.measurements import Candidate, Pair
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration
from cocalib.session.state import Session
from cocalib.view.wording import position_words

_FITS = 9.21  # 99 % quantile of chi-squared with 2 degrees of freedom
_BETTER = 0.5  # probability from which on another return is asked about
_SAME_M = 0.02
_MARGIN = 0.1  # of the image's width


@dataclass(frozen=True, slots=True)
class CandidateRow:
    """One radar return that may belong to a click.

    Attributes:
        position_m: (x, y, z) as the radar reports it.
        range_m: from the radar.
        azimuth_deg: positive to the left.
        elevation_deg: positive upwards.
        snr_db: mean of its returns; None if the radar has none.
        scans: in how many scans of the window it was seen.
        probability: that it is the reflector, 0 to 1; before there is a pose, its plausibility among the others.
        u_px: column of its reprojection; None without a pose, or if the camera does not see it.
        v_px: row.
        distance_px: from the click to the reprojection; None likewise.
        used: the pair has this return now.
        chosen: because a person chose it.
        words: where it is, as text: "20.0 m, 2.5° right, 0.4° down".
        answer: the same as a short answer: "20.0 m, 80 %".
    """

    position_m: tuple[float, float, float]
    range_m: float
    azimuth_deg: float
    elevation_deg: float
    snr_db: float | None
    scans: int
    probability: float | None
    u_px: float | None
    v_px: float | None
    distance_px: float | None
    used: bool
    chosen: bool
    words: str
    answer: str


@dataclass(frozen=True, slots=True)
class PairCandidates:
    """The candidates of the selected click.

    Attributes:
        click: its id.
        revision: of the session that they belong to.
        rows: the most probable first.
        asked: indices of the rows between which a person is to choose, the one in use first; empty if nothing is asked, or
            it was answered.
    """

    click: str
    revision: int
    rows: tuple[CandidateRow, ...]
    asked: tuple[int, ...] = ()


def pair_of_click(session: Session, click_id: str) -> Pair | None:
    """Return the pair of a click in the latest outcome, with all its candidates; None if it has none."""
    outcome = session.outcome
    if outcome is None:
        return None
    if isinstance(outcome, Calibration):
        return next((pair.measured for pair in outcome.pairs if pair.id == click_id), None)
    return next((pair for pair in outcome.pairs if pair.id == click_id), None)


def click_candidates(session: Session, pair: Pair, more: Sequence[Candidate] = ()) -> PairCandidates:
    """List the returns that may belong to a click.

    Args:
        session: with the latest outcome.
        pair: of the click, from that outcome.
        more: further returns of the window that may fit the pose.
    """
    calibration = session.outcome if isinstance(session.outcome, Calibration) else None
    candidates = _distinct((*pair.candidates, *pair.set_aside, *more))
    if calibration is not None:
        candidates = _in_view(calibration, candidates, _used_index(calibration, pair, candidates))
    used = _used_index(calibration, pair, candidates)
    fits = candidate_fits(calibration, pair, candidates) if calibration else ()
    rows = [
        _row(candidate, fits[i] if fits else None, used=i == used, chosen=i == used and pair.chosen is not None)
        for i, candidate in enumerate(candidates)
    ]
    order = sorted(range(len(rows)), key=lambda i: (-(rows[i].probability or 0.0), i))
    rivals = () if calibration is None else [one.rival for one in calibration.pairs if one.id == pair.id]
    rival = next((_index_at(pair.candidates[i].position_radar_m, candidates) for i in rivals if i >= 0), -1)
    better = _better_index(fits, used) if rival < 0 else rival
    asked = tuple(order.index(i) for i in (used, better) if i >= 0) if better >= 0 and pair.chosen is None else ()
    return PairCandidates(pair.id, session.revision, tuple(rows[i] for i in order), asked)


def _in_view(calibration: Calibration, candidates: Sequence[Candidate], used: int) -> list[Candidate]:
    """Leave out what the camera does not see, not even with a margin; the return in use stays."""
    camera = calibration.camera
    pixels_px = calibration.reproject(np.array([candidate.position_radar_m for candidate in candidates]))
    seen = camera.in_image(pixels_px, margin_px=_MARGIN * camera.width_px)
    return [candidate for i, candidate in enumerate(candidates) if seen[i] or i == used]


def _distinct(candidates: Sequence[Candidate]) -> list[Candidate]:
    kept: list[Candidate] = []
    for candidate in candidates:
        if all(np.abs(candidate.position_radar_m - other.position_radar_m).max() > _SAME_M for other in kept):
            kept.append(candidate)
    return kept


def _used_index(calibration: Calibration | None, pair: Pair, candidates: Sequence[Candidate]) -> int:
    """Return the index of the candidate in use; -1 before there is a pose."""
    if calibration is None:
        return 0 if pair.chosen is not None else -1
    return _index_at(next(one.point_radar_m for one in calibration.pairs if one.id == pair.id), candidates)


def _index_at(position_m: Vector3, candidates: Sequence[Candidate]) -> int:
    """Return the index of the candidate at a position; -1 if there is none."""
    away = [float(np.abs(candidate.position_radar_m - position_m).max()) for candidate in candidates]
    return int(np.argmin(away)) if away and min(away) <= _SAME_M else -1


def _better_index(fits: Sequence[CandidateFit], used: int) -> int:
    """Return the index of a candidate that fits where the one in use does not; -1 if there is none."""
    if not fits:
        return -1
    probability = [0.0 if math.isnan(fit.probability) else fit.probability for fit in fits]
    best = int(np.argmax(probability))
    in_use_fits = 0 <= used < len(fits) and fits[used].squared <= _FITS
    good = probability[best] >= _BETTER and fits[best].squared <= _FITS
    return best if good and best != used and not in_use_fits else -1


def _row(candidate: Candidate, fit: CandidateFit | None, *, used: bool, chosen: bool) -> CandidateRow:
    x_m, y_m, z_m = candidate.position_radar_m.tolist()
    range_m, azimuth, elevation = polar_from_cartesian(candidate.position_radar_m[None])[0].tolist()
    seen = fit is not None and bool(np.isfinite(fit.projected_px).all())
    u_px, v_px = fit.projected_px.tolist() if fit is not None and seen else (None, None)
    probability = _number(candidate.score if fit is None else fit.probability, 3)
    likely = "" if probability is None else f", {100.0 * probability:.0f} %"
    return CandidateRow(
        position_m=(x_m, y_m, z_m),
        range_m=round(range_m, 3),
        azimuth_deg=round(math.degrees(azimuth), 3),
        elevation_deg=round(math.degrees(elevation), 3),
        snr_db=_number(candidate.snr_db, 1),
        scans=candidate.scans,
        probability=probability,
        u_px=u_px,
        v_px=v_px,
        distance_px=_number(fit.distance_px, 2) if fit is not None and seen else None,
        used=used,
        chosen=chosen,
        words=position_words(candidate.position_radar_m),
        answer=f"{range_m:.1f} m{likely}",
    )


def _number(value: float, digits: int) -> float | None:
    return round(float(value), digits) if math.isfinite(value) else None
