"""One row per click: its state, its reprojection, its ellipse and a note, such as why it is an outlier."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib_core.measurements import Pair, ReflectorClick, Stamp, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration
from cocalib.session import RecordingFacts, Session
from cocalib.view.model import ClickRow, ClickState
from cocalib.view.reprojections import Reprojection, length_px, reprojections
from cocalib.view.wording import plain, sentence

_STRICT = 1.0 / 3.0
_GUESS = (
    "It stands where the radar expects the reflector, and nobody has looked: it does not count. "
    "Move it to the reflector's inner corner."
)
_NOISE = {"sigma_px": "click noise", "sigma_range_m": "range noise", "sigma_azimuth_deg": "azimuth noise"}


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Why pairs are outliers under some options.

    Attributes:
        what: what is wrong, the beginning of a sentence.
        action: what to do about it, a sentence.
    """

    what: str
    action: str


def click_rows(session: Session, facts: RecordingFacts) -> tuple[ClickRow, ...]:
    """Return one row per click, in order of image time; a row that is as before is the same object."""
    calibration = session.outcome if isinstance(session.outcome, Calibration) else None
    pairs = reprojections(calibration.pairs if calibration else session.checked)
    cause = disagreement(calibration.options) if calibration else disagreement(session.options)
    unpaired = {row.id: row for row in session.outcome.unpaired} if session.outcome else {}
    likely = {pair.id: pair for pair in session.outcome.pairs} if isinstance(session.outcome, Unsolvable) else {}
    times_ns = np.array([click.image_time for click in session.clicks], dtype=np.int64)
    rows = zip(session.clicks, facts.frames_at(times_ns).tolist(), strict=True)
    made = (_row(click, frame, pairs.get(click.id), unpaired.get(click.id), cause) for click, frame in rows)
    return tuple(_with_likely_return(row, likely[row.id]) if row.id in likely else row for row in made)


def _with_likely_return(row: ClickRow, pair: Pair) -> ClickRow:
    """Add where the most plausible radar return is, while there is no pose yet."""
    if row.range_m is not None:
        return row
    range_m, azimuth, elevation = polar_from_cartesian(pair.candidates[0].position_radar_m[None])[0].tolist()
    return replace(
        row,
        range_m=round(range_m, 4),
        azimuth_deg=round(math.degrees(azimuth), 4),
        elevation_deg=round(math.degrees(elevation), 4),
    )


@lru_cache(maxsize=1 << 15)
def _row(
    click: ReflectorClick, frame: int, pair: Reprojection | None, lone: Unpaired | None, cause: Disagreement
) -> ClickRow:
    stamp = Stamp.of(click.image_time)
    if pair is None:
        state: ClickState = _uncounted(click) or ("unpaired" if lone else "pending")
        note = f"{sentence(lone.reason)} {sentence(lone.hint)}" if lone else _GUESS if state == "untouched" else ""
        return ClickRow(
            click.id,
            stamp,
            frame,
            click.u_px,
            click.v_px,
            state,
            note=note,
            mark=click.mark,
            sigma_px=click.sigma_px,
            chosen=click.chosen is not None,
        )
    state = _state(click, pair)
    residual_px = _residual_px(click, pair)
    return ClickRow(
        id=click.id,
        image_time=stamp,
        frame=frame,
        u_px=click.u_px,
        v_px=click.v_px,
        state=state,
        projected_px=pair.projected_px,
        residual_px=residual_px,
        ellipse=pair.ellipse,
        range_m=pair.range_m,
        azimuth_deg=pair.azimuth_deg,
        elevation_deg=pair.elevation_deg,
        outlier_probability=pair.outlier_probability,
        note=_note(state, residual_px, pair, cause),
        mark=click.mark,
        sigma_px=click.sigma_px,
        chosen=click.chosen is not None,
    )


def _residual_px(click: ReflectorClick, pair: Reprojection) -> float | None:
    if pair.projected_px is None:
        return None
    if (click.u_px, click.v_px) == pair.pixel_px:
        return pair.distance_px
    u_px, v_px = pair.projected_px  # moved since that outcome
    return length_px(math.hypot(u_px - click.u_px, v_px - click.v_px), pair.step_px)


def _state(click: ReflectorClick, pair: Reprojection) -> ClickState:
    uncounted = _uncounted(click)
    if uncounted is not None:
        return uncounted
    if pair.excluded:  # included again since that outcome
        return "pending"
    return "inlier" if pair.inlier else "outlier"


def _uncounted(click: ReflectorClick) -> ClickState | None:
    """Return the state of a click that is not used to solve; None for others."""
    return "excluded" if click.excluded else None if click.counts else "untouched"


def _note(state: ClickState, residual_px: float | None, pair: Reprojection, cause: Disagreement) -> str:
    if state == "untouched":
        return _GUESS
    if state not in ("outlier", "excluded"):
        return ""
    where = "is behind the camera" if residual_px is None else f"reprojects {plain(residual_px)} px from the click"
    if state == "excluded":
        return f"Excluded; its radar position {where}."
    probability = pair.outlier_probability
    chance = "" if probability is None else f" (outlier probability {plain(100 * probability, 2)} %)"
    return f"{cause.what}{chance}: its radar position {where}. {cause.action}"


def disagreement(options: CalibrationOptions) -> Disagreement:
    """Say what makes a pair an outlier: the pair itself, the paper's method, or options that allow too little noise."""
    if not options.models_noise:
        return Disagreement(
            f"Outside the {options.paper.ransac_threshold_px:g} px of Algorithm 1's RANSAC, which uses it all the same",
            "The default method tells whether it is wrong.",
        )
    usual, given = NoiseOptions(), options.noise
    strict = [text for name, text in _NOISE.items() if getattr(given, name) < _STRICT * getattr(usual, name)]
    if not strict:
        return Disagreement("Disagrees with the other pairs", "Check the click, or exclude it.")
    return Disagreement(
        f"Does not fit the noise that the options state ({' and '.join(strict)} far below the default)",
        "Check these options before the click.",
    )
