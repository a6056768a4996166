"""Does the truth lie inside the error that a good or usable verdict states?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.defects.adversaries import draw_flat
from benchmarks.accuracy.figures import at_least, column, low, share, tally
from benchmarks.accuracy.outcomes import LEVELS, level_counts
from benchmarks.accuracy.rows import Claim, Figures, Kept, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs, draw_systematic_errors, simulate_pairs
from calib_core.arrays import Points2, Points3
from calib_core.calibration import calibrate, calibrate_pairs
from calib_core.geometry import RigidTransform
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.radar import cartesian_from_polar
from calib_core.results import Calibration
from calib_core.results.verdict import VerdictLevel, stated_error, verdict_on
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.recording import simulate

_TRIALS, _RECORDINGS = 16, 2
_UNSEEN = 20
"""Placements that are not used, but reprojected."""
_AIM = 95.0
_FIRST_SEED = 910_000


@dataclass(frozen=True, slots=True)
class Verdicts:
    """Pairs that are drawn with the errors that they share, and whether the camera position is given."""

    noise: NoiseName
    pairs: int
    tape_m: float | None
    outlier_share: float = 0.1
    scene: str = "field"

    @property
    def key(self) -> str:
        """A file name."""
        known = "free" if self.tape_m is None else "tape"
        return f"verdict-{self.scene}-{self.noise}-{self.pairs}-{self.outlier_share:.0%}-{known}".replace("%", "pc")


_CASES = (
    *(Verdicts(*what) for what in product(("ti", "ti_fine", "imaging"), (6, 10), (None, 0.01), (0.2,))),
    *(Verdicts(noise, 15, None, 0.0, "flat") for noise in ("ti", "imaging")),
)
_PRESETS: tuple[PresetName, ...] = ("default", "biased-radar", "companion", "car-park", "principal-point")


def measure_verdict(case: Verdicts, trial: int) -> Figures:
    """Solve one set with the default options, and compare the error with the one that its verdict states."""
    rng = np.random.default_rng([2051, trial, case.pairs])
    drawn = _drawn(case, rng)
    options = CalibrationOptions(solving=tape_measured(case.tape_m))
    outcome = calibrate_pairs(drawn.pairs[: case.pairs], drawn.camera, options)
    unseen = drawn.points_radar_m[case.pairs :]
    reported = drawn.systematic.without_elevation(cartesian_from_polar(drawn.systematic.reported_polar(unseen)))
    return _figures(outcome, drawn.camera_from_radar, reported, drawn.pixels_px[case.pairs :])


def _drawn(case: Verdicts, rng: np.random.Generator) -> SimulatedPairs:
    count = case.pairs + _UNSEEN
    if case.scene == "flat":
        return draw_flat(rng, count, noise=case.noise)
    return simulate_pairs(
        count,
        rng=rng,
        noise=case.noise,
        outlier_share=case.outlier_share,
        systematic=draw_systematic_errors(rng),
    )


def measure_recording(preset: PresetName, trial: int) -> Figures:
    """Solve the example clicks of a simulated recording, and compare likewise at its own placements."""
    simulated = simulate(replace(PRESETS[preset], seed=_FIRST_SEED + trial))
    outcome = calibrate(simulated.clicks, simulated.scans, simulated.stage.published_camera, background=simulated.scans)
    truth = simulated.stage.camera_from_reported
    points_radar_m = truth.inverse() @ (simulated.camera_from_radar @ simulated.points_radar_m)
    if PRESETS[preset].defects.elevation == "measured":
        return _figures(outcome, truth, points_radar_m, simulated.pixels_px, reported=False)
    left_m = points_radar_m[:, 1]
    ahead_m = np.sqrt(np.square(points_radar_m).sum(axis=1) - np.square(left_m))  # of a row of antennas
    return _figures(outcome, truth, np.column_stack([ahead_m, left_m, np.zeros(len(left_m))]), simulated.pixels_px)


def _figures(
    outcome: Calibration | Unsolvable,
    truth: RigidTransform,
    points_radar_m: Points3,
    pixels_px: Points2,
    *,
    reported: bool = True,
) -> Figures:
    """Return the level, the errors, and whether each is inside the stated one.

    Args:
        outcome: of the solve.
        truth: the true pose of the axes in which the radar reports.
        points_radar_m: (n, 3) positions without noise.
        pixels_px: (n, 2) where they are in the image.
        reported: whether these are positions with the radar's errors; otherwise true ones.
    """
    figures: Figures = {"level": float(LEVELS.index(verdict_on(outcome).level))}
    if isinstance(outcome, Unsolvable):
        return figures
    stated, error = stated_error(outcome), truth.error_from(outcome.camera_from_radar)
    about_axes = outcome.camera_from_radar.rotation.T @ error[3:]
    rotation_deg = float(np.rad2deg(abs(about_axes[2]) if stated.in_plane else np.linalg.norm(error[3:])))
    away_m = outcome.camera_from_radar.inverse().translation_m - truth.inverse().translation_m
    place = _middle(points_radar_m, stated.range_m)
    point = points_radar_m[place : place + 1]
    projected_px = outcome.reproject(point) if reported else outcome.camera.project(outcome.camera_from_radar @ point)
    return figures | {
        "rotation_deg": rotation_deg,
        "position_cm": 100.0 * float(np.linalg.norm(away_m)),
        "image_px": float(np.linalg.norm(projected_px[0] - pixels_px[place])),
        "stated_deg": stated.rotation_deg,
        "stated_cm": stated.position_cm if np.isfinite(stated.position_cm) else None,
        "stated_px": stated.image_px,
    }


def _middle(points_radar_m: Points3, range_m: float) -> int:
    """Return the position nearest to the middle direction at a range."""
    ranges_m = np.linalg.norm(points_radar_m, axis=1, keepdims=True)
    middle = (points_radar_m / ranges_m).mean(axis=0)
    return int(np.argmin(np.linalg.norm(points_radar_m - range_m * middle / np.linalg.norm(middle), axis=1)))


ROWS = (
    *(Row(case.key, _TRIALS, partial(measure_verdict, case), draws) for draws, case in enumerate(_CASES)),
    *(Row(f"verdict-preset-{preset}", _RECORDINGS, partial(measure_recording, preset)) for preset in _PRESETS),
)


def share_inside(trials: Sequence[Figures], levels: Sequence[VerdictLevel]) -> np.ndarray:
    """Flag the trials of these levels whose errors are all inside what the sentence states."""
    wanted = [LEVELS.index(level) for level in levels]
    judged = [one for one in trials if one["level"] in wanted]
    names = (("rotation_deg", "stated_deg"), ("position_cm", "stated_cm"), ("image_px", "stated_px"))
    parts = [
        np.isnan(column(judged, stated)) | (column(judged, error) <= column(judged, stated)) for error, stated in names
    ]
    return np.all(parts, axis=0) if judged else np.zeros(0, dtype=np.bool_)


def section(kept: Kept) -> Section:
    """Judge the levels, and each row."""
    rows, judged, outside = [], [], []
    everything: list[Figures] = []
    for row in ROWS:
        trials = kept.get(row.key, ())
        if not trials:
            continue
        everything += trials
        name = row.key.removeprefix("verdict-")
        held = share(share_inside(trials, ("good", "usable")).astype(np.float64))
        verdict = at_least(held, _AIM)
        outside += [f"{name} ({held.value:.0f} %)"] if low(held) else []
        rows.append(
            {"row": name, "sets": str(len(trials))}
            | level_counts(trials)
            | {"inside, good and usable": held.percent, "aim": f"{_AIM:g} %", "verdict": verdict}
        )
        judged += [(name, f"{held.value:.0f} %", verdict)] if np.isfinite(held.value) else []
    claims = []
    for levels in (("good", "usable"), ("coarse",)):
        flags = share_inside(everything, levels).astype(np.float64)
        aim = f"{' or '.join(levels)}: all three errors inside the stated ones in {_AIM:g} %"
        claims.append(Claim(aim, f"{share(flags).percent} of {len(flags)}", at_least(share(flags), _AIM)))
    claims.append(tally(f"the same in each row, good or usable: {_AIM:g} %", judged))
    title = "Few pairs, and whole recordings: is the error that the verdict states right?"
    return Section(title, _TEXT, tuple(claims), tuple(rows), tuple(outside))


_TEXT = """The verdict states a rotation, a camera position, and pixels in the middle of the placements. Pairs: 6 and 10, one
in five wrong, and 15 of a radar without elevation, with the errors that all pairs share. Presets of `cocalib simulate`, most
with a defect, from their example clicks."""
