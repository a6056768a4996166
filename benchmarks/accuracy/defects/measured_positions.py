"""With a camera position that was measured wrong: is it within the stated error, or named, and how far is the pose still off?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from benchmarks.accuracy.figures import at_least, column, share
from benchmarks.accuracy.outcomes import codes_in, outcome_figures, quantile_999, silently_wrong
from benchmarks.accuracy.rows import Claim, Figures, Kept, Part, Row, Section
from benchmarks.simulated_pairs import NoiseName, SimulatedPairs, draw_systematic_errors, simulate_pairs, study_camera
from calib_core.calibration import calibrate_pairs
from calib_core.geometry import camera_position_jacobian
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions, CameraPositionPrior, HowMeasured, SolvingOptions
from calib_core.results.verdict import stated_error, verdict_on
from calib_core.synthetic.rig import Rig, RigOptions, random_rig

__all__ = ["ROWS", "measure", "section"]

_TRIALS = 60
_COUNTS = (12, 20, 40)
_NOISES: tuple[NoiseName, ...] = ("ti", "imaging")
_ASIDE = RigOptions(camera_offset_m=(0.08, 0.22, 0.12))
_NAMES = ("camera-position-contradicted", "camera-position-doubtful")
_BESIDE = (*_NAMES, "angle-scale")
_LARGEST_M = 0.12
_ROUGH_M = 0.005  # what is not part of a slip, per axis
_LEVEL = 0.02  # of the test that names a position


@dataclass(frozen=True, slots=True)
class Slip:
    """How a camera position was measured wrong.

    Attributes:
        key: a file name.
        finding: for the table.
        aim: which of the aims it counts for: "right", "small", "11 cm" or "large".
        off_m: (3,) forward, left, up; or a distance in any direction.
        sigma_m: per axis, at random.
        mirrored: the sign of left is wrong, of a camera 22 cm to the left.
        how: as the user says it was measured; None says nothing.
    """

    key: str
    finding: str
    aim: str
    off_m: tuple[float, float, float] | float = 0.0
    sigma_m: float = _ROUGH_M
    mirrored: bool = False
    how: HowMeasured | None = None

    def measured_m(self, rig: Rig, rng: np.random.Generator) -> tuple[float, float, float]:
        """Return the position as measured."""
        centre_m = rig.camera_position_radar_m * np.array([1.0, -1.0 if self.mirrored else 1.0, 1.0])
        off_m = np.array(self.off_m)
        if not off_m.shape:
            direction = rng.standard_normal(3)
            off_m = off_m * direction / np.linalg.norm(direction)
        forward, left, up = (centre_m + off_m + self.sigma_m * rng.standard_normal(3)).tolist()
        return forward, left, up


SLIPS = (
    Slip("right", "right to 1 cm per axis", "right", sigma_m=0.01),
    Slip("up-5", "5 cm up", "small", (0.0, 0.0, 0.05)),
    Slip("forward-5", "5 cm forward", "small", (0.05, 0.0, 0.0)),
    Slip("forward-10", "10 cm forward", "small", (0.1, 0.0, 0.0)),
    Slip("housing", "to the housing: 10 cm forward, 5 cm up", "small", (0.1, 0.0, 0.05)),
    Slip("housing-said", "the same, and said so", "small", (0.1, 0.0, 0.05), how="housing"),
    Slip("random-3", "3 cm per axis", "small", sigma_m=0.03),
    Slip("any-11", "11 cm in any direction", "11 cm", 0.11),
    Slip("any-30", "30 cm in any direction", "large", 0.3),
    Slip("sign", "wrong sign of left, 22 cm", "large", mirrored=True),
)


def measure(slip: Slip, noise: NoiseName, trial: int) -> Figures:
    """Solve one set of 12, 20 or 40 pairs, none or one in ten of them wrong, shared errors from the priors."""
    count = _COUNTS[trial % 3]
    rng = np.random.default_rng([2090, trial])
    rig = random_rig(rng, camera=study_camera(), options=_ASIDE if slip.mirrored else RigOptions())
    errors = draw_systematic_errors(np.random.default_rng([2091, trial]))
    simulated = simulate_pairs(
        count, rng=rng, noise=noise, rig=rig, outlier_share=0.1 * (trial // 3 % 2), systematic=errors
    )
    position_m = slip.measured_m(rig, np.random.default_rng([2092, trial]))
    prior = CameraPositionPrior(position_m) if slip.how is None else CameraPositionPrior.measured(position_m, slip.how)
    options = CalibrationOptions(solving=SolvingOptions(camera_position=prior))
    outcome = calibrate_pairs(simulated.pairs, simulated.camera, options)
    figures = outcome_figures(outcome, simulated.camera_from_radar)
    figures["relied on"] = float(verdict_on(outcome).level in ("good", "usable"))
    if isinstance(outcome, Unsolvable):
        return figures
    stated = stated_error(outcome)
    figures |= {"stated 95 % deg": stated.rotation_deg, "stated 95 % cm": stated.position_cm}
    return figures if slip.aim != "large" else figures | _possible(simulated, np.array(position_m), prior.sigma_m)


def _possible(simulated: SimulatedPairs, position_m: np.ndarray, sigma_m: float) -> Figures:
    """Return what the pairs alone can do, by the covariance that they state: name this slip, and place the camera.

    The first is the power of the chi-square test at 2 %, the second the probability of an error of at most 12 cm.
    """
    from scipy.special import chdtri, chndtr

    alone = calibrate_pairs(simulated.pairs, simulated.camera)
    if isinstance(alone, Unsolvable):
        return {"can name": 0.0, "can place": 0.0}
    to_centre = camera_position_jacobian(alone.camera_from_radar)
    covariance = to_centre @ alone.covariance @ to_centre.T
    off_m = position_m - simulated.rig.camera_position_radar_m
    squared = float(off_m @ np.linalg.solve(covariance + sigma_m**2 * np.eye(3), off_m))
    errors_m = np.random.default_rng(2093).standard_normal((2000, 3)) @ np.linalg.cholesky(covariance).T
    return {
        "can name": 1.0 - float(chndtr(chdtri(3.0, _LEVEL), 3.0, squared)),
        "can place": float((np.linalg.norm(errors_m, axis=1) <= _LARGEST_M).mean()),
    }


def _key(slip: Slip, noise: NoiseName) -> str:
    return f"measured-{slip.key}-{noise}"


_CASES = tuple(product(SLIPS, _NOISES))
ROWS = tuple(Row(_key(slip, noise), _TRIALS, partial(measure, slip, noise)) for slip, noise in _CASES)


def section(kept: Kept) -> Section:
    """Write the table, a line for each slip and radar."""
    lines = [_Line.of(slip, noise, kept.get(_key(slip, noise), ())) for slip, noise in _CASES]
    lines = [line for line in lines if line.trials]
    head = (
        "measured",
        "radar",
        "trials",
        "relied on",
        "inside 95 %",
        "99.9 % or named",
        "silent",
        "named",
        "error, cm",
    )
    parts = (Part("", head, tuple(line.cells() for line in lines)),)
    return Section("A camera position that was measured wrong", _TEXT, parts, _claims(lines))


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """The trials of one slip with one radar, as flags (t,)."""

    slip: Slip
    noise: str
    relied: np.ndarray
    inside: np.ndarray
    nearly: np.ndarray
    silent: np.ndarray
    named: np.ndarray
    error_m: np.ndarray
    can_name: np.ndarray
    can_place: np.ndarray

    @classmethod
    def of(cls, slip: Slip, noise: NoiseName, trials: Sequence[Figures]) -> "_Line":
        error_m, turned = column(trials, "position_m"), np.rad2deg(column(trials, "rotation_rad"))
        relied = column(trials, "relied on") > 0.0
        named = np.array([bool(codes_in(one) & set(_NAMES)) for one in trials], dtype=np.bool_)
        limits = np.array([quantile_999(one["quantile"] or 0.0) if "quantile" in one else np.nan for one in trials])
        return cls(
            slip,
            noise,
            relied,
            (turned <= column(trials, "stated 95 % deg")) & (100.0 * error_m <= column(trials, "stated 95 % cm")),
            (column(trials, "squared") <= limits) | named,
            silently_wrong(trials, _BESIDE) & relied,
            named,
            error_m,
            column(trials, "can name"),
            column(trials, "can place"),
        )

    @property
    def trials(self) -> int:
        """How many there are."""
        return len(self.relied)

    def cells(self) -> tuple[str, ...]:
        """Return the line of the table."""
        relied = self.relied
        middle_cm, most_cm = 100.0 * np.nanquantile(self.error_m, (0.5, 0.95))
        return (
            *(self.slip.finding, self.noise, str(self.trials), str(int(relied.sum()))),
            *(share(self.inside[relied]).percent, share(self.nearly).percent, str(int(self.silent.sum()))),
            *(share(self.named).percent, f"{middle_cm:.1f}, 95 %: {most_cm:.1f}"),
        )


def _claims(lines: Sequence[_Line]) -> tuple[Claim, ...]:
    relied, small = _gathered(lines, "small", "relied"), _gathered(lines, "small", "inside")
    silent, large = _gathered(lines, "small", "silent"), _gathered(lines, "large", "named")
    found = large.astype(np.bool_)
    near = _gathered(lines, "large", "error_m")[found] <= _LARGEST_M
    can_name, can_place = (_gathered(lines, "large", name) for name in ("can_name", "can_place"))
    return (
        _claim(
            "measured 3 to 11 cm off: of what is good or usable, inside the 95 % figures in 95 %",
            small[relied > 0],
            95.0,
        ),
        _claim("the same: not silently wrong", 1.0 - silent, 100.0),
        _claim(
            "11 cm off in any direction: inside 99.9 %, or named, in 95 %", _gathered(lines, "11 cm", "nearly"), 95.0
        ),
        _claim("30 cm off or a wrong sign: named in 95 %", large, 95.0, can_name),
        _claim("the same, named: the position is within 12 cm of the truth in 95 %", near, 95.0, can_place[found]),
        _claim("measured right: not named in 99 %", 1.0 - _gathered(lines, "right", "named"), 99.0),
    )


def _gathered(lines: Sequence[_Line], aim: str, name: str) -> np.ndarray:
    found = [np.asarray(getattr(line, name), dtype=np.float64) for line in lines if line.slip.aim == aim]
    return np.concatenate(found) if found else np.zeros(0)


def _claim(aim: str, met: np.ndarray, least: float, can: np.ndarray | None = None) -> Claim:
    """Judge a share by the least that is aimed at, in percent, and say how many the pairs alone can reach."""
    if not len(met):
        return Claim(aim, "not run", "not run")
    possible = "" if can is None else f"; the pairs alone can reach {np.nansum(can):.0f}"
    return Claim(aim, f"{int(met.sum())} of {len(met)}{possible}", at_least(share(met), least))


_TEXT = """Each row draws sets of 12, 20 and 40 pairs, none or one in ten of them wrong, with shared errors from the priors,
and gives a camera position that is wrong in one way, with the default standard deviation unless it is said how it was
measured. "Relied on" counts the good and usable ones; of these "inside 95 %" is the share whose rotation and position are
both within the verdict's figures. "Silent" is good or usable with a truth beyond twice the stated 99.9 % quantile, without
`camera-position-contradicted`, `camera-position-doubtful` or an `angle-scale` that names the position; "named" is one of the
first two. The error is that of the camera's position: median and 95 % quantile. Of positions 30 cm off or with a wrong sign,
what the pairs alone can reach follows from the covariance that they state without the position: the power of the chi-square
test that calls a right position doubtful in 2 %, and the probability that the position from them is within 12 cm. From 12 or
20 pairs of the coarse radar it is known to 12 to 15 cm (one sigma), so that 12 cm in 95 % cannot be reached with it."""
