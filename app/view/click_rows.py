"""One row per click: its state, its reprojection, its ellipse and a note."""

from collections.abc import Mapping

import numpy as np

from app.session import RecordingFacts, Session
from app.view.model import ClickRow, ClickState, Ellipse
from app.view.number_format import plain
from app.view.wording import sentence
from calib_core.arrays import Points2
from calib_core.measurements import ReflectorClick, Stamp, Unpaired
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration, PairResult

__all__ = ["click_rows", "ellipse_of"]

_CHI2_95_2D = 5.991464547107979  # 95 % quantile of chi-squared with 2 degrees of freedom


def click_rows(session: Session, facts: RecordingFacts) -> tuple[ClickRow, ...]:
    """Return one row per click, in order of image time."""
    calibration = session.outcome if isinstance(session.outcome, Calibration) else None
    pairs = {pair.id: pair for pair in (calibration.pairs if calibration else session.checked)}
    unpaired = {row.id: row for row in session.outcome.unpaired} if session.outcome else {}
    return tuple(_row(click, facts, pairs, unpaired) for click in session.clicks)


def ellipse_of(covariance_px2: Points2) -> Ellipse | None:
    """Return the 95 % ellipse of a (2, 2) covariance [px^2]; None if it is not known."""
    if not np.all(np.isfinite(covariance_px2)):
        return None
    squares, axes = np.linalg.eigh((covariance_px2 + covariance_px2.T) / 2.0)
    semi_minor_px, semi_major_px = np.sqrt(np.maximum(squares, 0.0) * _CHI2_95_2D)
    angle_rad = np.arctan2(axes[1, 1], axes[0, 1]) % np.pi
    return Ellipse(float(semi_major_px), float(semi_minor_px), float(angle_rad))


def _row(
    click: ReflectorClick, facts: RecordingFacts, pairs: Mapping[str, PairResult], unpaired: Mapping[str, Unpaired]
) -> ClickRow:
    frame = facts.frame_at(click.image_time)
    stamp = Stamp.of(click.image_time)
    frame = -1 if frame is None else frame
    pair, lone = pairs.get(click.id), unpaired.get(click.id)
    if pair is None:
        state: ClickState = "excluded" if click.excluded else "unpaired" if lone else "pending"
        note = f"{sentence(lone.reason)} {sentence(lone.hint)}" if lone else ""
        return ClickRow(click.id, stamp, frame, click.u_px, click.v_px, state, note=note)
    state = _state(click, pair)
    projected_px = _finite_pixel(pair)
    residual_px = (
        None if projected_px is None else float(np.hypot(projected_px[0] - click.u_px, projected_px[1] - click.v_px))
    )
    range_m, azimuth_rad, elevation_rad = (float(value) for value in polar_from_cartesian(pair.point_radar_m))
    return ClickRow(
        id=click.id,
        image_time=stamp,
        frame=frame,
        u_px=click.u_px,
        v_px=click.v_px,
        state=state,
        projected_px=projected_px,
        residual_px=residual_px,
        ellipse=ellipse_of(pair.expected_covariance_px2),
        range_m=range_m,
        azimuth_deg=float(np.rad2deg(azimuth_rad)),
        elevation_deg=float(np.rad2deg(elevation_rad)),
        outlier_probability=None if np.isnan(pair.outlier_probability) else pair.outlier_probability,
        note=_note(state, residual_px, pair),
    )


def _state(click: ReflectorClick, pair: PairResult) -> ClickState:
    if click.excluded:
        return "excluded"
    if pair.excluded:  # included again since that outcome
        return "pending"
    return "inlier" if pair.inlier else "outlier"


def _finite_pixel(pair: PairResult) -> tuple[float, float] | None:
    u_px, v_px = (float(value) for value in pair.projected_px)
    return (u_px, v_px) if np.isfinite(u_px) and np.isfinite(v_px) else None


def _note(state: ClickState, residual_px: float | None, pair: PairResult) -> str:
    where = "is behind the camera" if residual_px is None else f"reprojects {plain(residual_px)} px from the click"
    if state == "outlier":
        unknown = np.isnan(pair.outlier_probability)
        chance = "" if unknown else f" (outlier probability {plain(100 * pair.outlier_probability, 2)} %)"
        return f"Disagrees with the other pairs{chance}: its radar position {where}. Check the click, or exclude it."
    if state == "excluded":
        return f"Excluded; its radar position {where}."
    return ""
