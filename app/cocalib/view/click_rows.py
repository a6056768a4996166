"""One row per click: its state, its reprojection, its ellipse and a note, such as why it is an outlier."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from calib_core.arrays import Flags
from calib_core.measurements import Pair, ReflectorClick, Stamp, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions, NoiseOptions
from calib_core.radar import polar_from_cartesian
from calib_core.results import Calibration, PairResult
from calib_core.results.calibration import CHI2_95_2
from calib_core.words.outcomes import in_sentences
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.model import ClickRow, ClickState, Ellipse
from cocalib.view.wording import plain, position_words

# Pixels are rounded to steps of at most 1 % of the pair's ellipse and a quarter of a pixel, which cannot be seen: with many
# clicks, one more then leaves most pairs as they are, and only the others are sent to the page.
_SHARE, _FINEST_PX, _COARSEST_PX = 0.01, 2.0**-7, 0.25
"""Steps of pixels: this share of the ellipse's semi-major axis, within these limits, then down to a power of two."""
_DECIMALS_RAD, _DECIMALS_POSITION, _DECIMALS_PROBABILITY = 2, 4, 3


@dataclass(frozen=True, slots=True)
class Reprojection:
    """One pair under the solved pose, as it is drawn.

    Attributes:
        projected_px: (u, v), in whole steps; None if the radar position lies behind the camera.
        step_px: to which pixels of this pair are rounded.
        pixel_px: (u, v) of the click that was solved.
        distance_px: from there to the reprojection before it was rounded; None if the radar position lies behind the camera.
        ellipse: None if the method has no noise model.
        range_m: of the radar position.
        azimuth_deg: of the radar position, positive to the left.
        elevation_deg: of the radar position, positive upwards.
        inlier: it took part in the pose.
        excluded: the user had left it out.
        outlier_probability: 0 to 1, to 0.001; None if the method has none.
        rival: where another return is that explains the click as well; "" if there is none.
    """

    projected_px: tuple[float, float] | None
    step_px: float
    pixel_px: tuple[float, float]
    distance_px: float | None
    ellipse: Ellipse | None
    range_m: float
    azimuth_deg: float
    elevation_deg: float
    inlier: bool
    excluded: bool
    outlier_probability: float | None
    rival: str = ""


@lru_cache(maxsize=2)
def reprojections(pairs: tuple[PairResult, ...]) -> Mapping[str, Reprojection]:
    """Return the reprojection of each pair, by id."""
    if not pairs:
        return {}
    ellipses = ellipses_of([pair.expected_covariance_px2 for pair in pairs])
    lengths_px = np.array([0.0 if ellipse is None else ellipse.semi_major_px for ellipse in ellipses])
    # what the pixels of each pair are rounded to
    steps_px = 2.0 ** np.floor(np.log2(np.clip(_SHARE * lengths_px, _FINEST_PX, _COARSEST_PX)))
    projected = np.round(np.array([pair.projected_px for pair in pairs]) / steps_px[:, None]) * steps_px[:, None]
    polar = polar_from_cartesian(np.array([pair.point_radar_m for pair in pairs]))
    polar[:, 1:] = np.rad2deg(polar[:, 1:])
    positions = np.round(polar, _DECIMALS_POSITION)
    rows = zip(pairs, projected.tolist(), steps_px.tolist(), ellipses, positions.tolist(), strict=True)
    return {
        pair.id: Reprojection(
            projected_px=(u_px, v_px) if math.isfinite(u_px) and math.isfinite(v_px) else None,
            step_px=step_px,
            pixel_px=(float(pair.pixel_px[0]), float(pair.pixel_px[1])),
            distance_px=length_px(pair.distance_px, step_px) if math.isfinite(pair.distance_px) else None,
            ellipse=None if ellipse is None else _in_steps(ellipse, step_px),
            range_m=range_m,
            azimuth_deg=azimuth_deg,
            elevation_deg=elevation_deg,
            inlier=pair.inlier,
            excluded=pair.excluded,
            outlier_probability=_rounded(pair.outlier_probability),
            rival=_rival(pair),
        )
        for pair, (u_px, v_px), step_px, ellipse, (range_m, azimuth_deg, elevation_deg) in rows
    }


def _rival(pair: PairResult) -> str:
    if pair.rival < 0 or pair.measured is None:
        return ""
    return position_words(pair.measured.candidates[pair.rival].position_radar_m)


def length_px(distance_px: float, step_px: float) -> float:
    """Round the length of a residual to a power of ten, the largest that is not above the step."""
    return round(distance_px, -math.floor(math.log10(step_px)))


def _rounded(probability: float) -> float | None:
    return None if math.isnan(probability) else round(float(probability), _DECIMALS_PROBABILITY)


def _in_steps(ellipse: Ellipse, step_px: float) -> Ellipse:
    major_px, minor_px = (round(axis / step_px) * step_px for axis in (ellipse.semi_major_px, ellipse.semi_minor_px))
    return Ellipse(major_px, minor_px, ellipse.angle_rad)


def ellipses_of(covariances_px2: Sequence[np.ndarray]) -> list[Ellipse | None]:
    """Return the 95 % ellipses of covariances (n, 2, 2) [px^2]; None where one is not known."""
    covariances = np.asarray(covariances_px2, dtype=np.float64).reshape(-1, 2, 2)
    known: Flags = np.all(np.isfinite(covariances), axis=(1, 2))
    symmetric = (covariances[known] + covariances[known].swapaxes(1, 2)) / 2.0
    squares, axes = np.linalg.eigh(symmetric)
    minor_and_major = np.sqrt(np.maximum(squares, 0.0) * CHI2_95_2)
    angles = np.round(np.arctan2(axes[:, 1, 1], axes[:, 0, 1]) % np.pi, _DECIMALS_RAD)
    ellipses: list[Ellipse | None] = [None] * len(covariances)
    for place, (minor, major), angle in zip(
        np.flatnonzero(known), minor_and_major.tolist(), angles.tolist(), strict=True
    ):
        ellipses[place] = Ellipse(major, minor, angle)
    return ellipses


_STRICT = 1.0 / 3.0
_GUESS = (
    "It stands where the radar expects the reflector, and nobody has looked: it does not count. "
    "Move it to the reflector's inner corner."
)
_NOISE = {"sigma_px": "click noise", "sigma_range_m": "range noise", "sigma_azimuth_deg": "azimuth noise"}


@dataclass(frozen=True, slots=True)
class _Disagreement:
    """Why pairs are outliers under some options.

    Attributes:
        what: what is wrong, the beginning of a sentence.
        action: what to do about it, a sentence.
        of_pair: the pair itself may be wrong, not the method or the options.
    """

    what: str
    action: str
    of_pair: bool = False


def click_rows(session: Session, facts: RecordingFacts, placements: Mapping[str, int]) -> tuple[ClickRow, ...]:
    """Return one row per click, in order of image time; a row that is as before is the same object.

    Args:
        session: with its clicks and the latest outcome.
        facts: the recording's frames.
        placements: the number of each click's placement, by id.
    """
    calibration = session.outcome if isinstance(session.outcome, Calibration) else None
    pairs = reprojections(calibration.pairs if calibration else session.checked)
    cause = disagreement(calibration.options) if calibration else disagreement(session.options)
    unpaired = {row.id: row for row in session.outcome.unpaired} if session.outcome else {}
    likely = {pair.id: pair for pair in session.outcome.pairs} if isinstance(session.outcome, Unsolvable) else {}
    times_ns = np.array([click.image_time for click in session.clicks], dtype=np.int64)
    rows = zip(session.clicks, facts.frames_at(times_ns).tolist(), strict=True)
    made = (
        _row(click, frame, pairs.get(click.id), unpaired.get(click.id), cause, placements[click.id])
        for click, frame in rows
    )
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
    click: ReflectorClick,
    frame: int,
    pair: Reprojection | None,
    lone: Unpaired | None,
    cause: _Disagreement,
    placement: int,
) -> ClickRow:
    stamp = Stamp.of(click.image_time)
    if pair is None:
        state: ClickState = _uncounted(click) or ("unpaired" if lone else "pending")
        note = str(in_sentences(lone)) if lone else _GUESS if state == "untouched" else ""
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
            placement=placement,
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
        disagrees=state == "outlier" and not pair.rival and cause.of_pair,
        mark=click.mark,
        sigma_px=click.sigma_px,
        chosen=click.chosen is not None,
        placement=placement,
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


def _note(state: ClickState, residual_px: float | None, pair: Reprojection, cause: _Disagreement) -> str:
    if state == "untouched":
        return _GUESS
    if state not in ("outlier", "excluded"):
        return ""
    where = "is behind the camera" if residual_px is None else f"reprojects {plain(residual_px)} px from the click"
    if state == "excluded":
        return f"Excluded; its radar position {where}."
    if pair.rival:
        return f"Another return, {pair.rival}, explains this click as well: it counts half until you choose (C)."
    probability = pair.outlier_probability
    chance = "" if probability is None else f" (outlier probability {plain(100 * probability, 2)} %)"
    return f"{cause.what}{chance}: its radar position {where}. {cause.action}"


def disagreement(options: CalibrationOptions) -> _Disagreement:
    """Say what makes a pair an outlier: the pair itself, the paper's method, or options that allow too little noise."""
    if not options.models_noise:
        return _Disagreement(
            f"Outside the {options.paper.ransac_threshold_px:g} px of Algorithm 1's RANSAC, which uses it all the same",
            "The default method tells whether it is wrong.",
        )
    usual, given = NoiseOptions(), options.noise
    strict = [text for name, text in _NOISE.items() if getattr(given, name) < _STRICT * getattr(usual, name)]
    if not strict:
        return _Disagreement("Disagrees with the other pairs", "Check the click, or exclude it.", of_pair=True)
    return _Disagreement(
        f"Does not fit the noise that the options state ({' and '.join(strict)} far below the default)",
        "Check these options before the click.",
    )
