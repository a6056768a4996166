"""How a row of the adversarial table is drawn and solved."""

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.defects.pair_defects import draw_flat_radar_rig, random_rig_apart
from benchmarks.accuracy.outcomes import solved_or_refused
from benchmarks.simulated_pairs import (
    FIELD,
    NoiseName,
    SimulatedPairs,
    SystematicErrors,
    draw_systematic_errors,
    simulate_pairs,
    study_camera,
)
from calib_core.calibration import calibrate_pairs
from calib_core.errors import OptionError
from calib_core.geometry import RigidTransform
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.synthetic.rig import Rig, random_rig
from calib_core.synthetic.scene.scenes import PairsLayout

FLAT = SystematicErrors(measures_elevation=False)
_EXACT = SystematicErrors()
_DEFAULTS = CalibrationOptions()

Change = Callable[[SimulatedPairs, np.random.Generator], SimulatedPairs]


@dataclass(frozen=True, slots=True, eq=False)
class Solved:
    """An outcome and the true pose."""

    outcome: Calibration | Unsolvable
    truth: RigidTransform


@dataclass(frozen=True, slots=True)
class Adversary:
    """A row of the adversarial table.

    Attributes:
        key: a file name.
        finding: for the table.
        codes: the warnings that name the cause; docs/warnings.md describes each.
        solve: draw a trial and solve it.
        always_wrong: no pose is true of such pairs: without one of the codes, every pose is silently wrong.
        trusted: (deg, m) errors above which an outcome without covariance and without a code is silently wrong.
        gauge: another pose explains such pairs exactly as well, so that no estimator can see the defect in them.
    """

    key: str
    finding: str
    codes: tuple[str, ...]
    solve: Callable[[int], Solved]
    always_wrong: bool = False
    trusted: tuple[float, float] | None = None
    gauge: bool = False


@dataclass(frozen=True, slots=True)
class Draw:
    """Pairs with a defect, and the options of the estimator that solves them."""

    key: str
    noise: NoiseName = "imaging"
    pairs: int = 20
    tape_m: float | None = None
    errors: SystematicErrors | None = _EXACT
    """None draws them from the priors."""
    outlier_share: float = 0.0
    layout: PairsLayout = FIELD
    apart_m: float = 0.0
    """Distance between the sensors, which the estimator is told; 0: mounted together."""
    change: Change | None = None
    options: CalibrationOptions = _DEFAULTS

    def __call__(self, trial: int) -> Solved:
        """Draw one trial and solve it."""
        rng = generator(self.key, trial)
        errors = draw_systematic_errors(rng) if self.errors is None else self.errors
        rig = self._rig(rng)
        simulated = simulate_pairs(
            self.pairs,
            rng=rng,
            noise=self.noise,
            outlier_share=self.outlier_share,
            layout=self.layout,
            rig=rig,
            systematic=errors,
        )
        changed = simulated if self.change is None else self.change(simulated, rng)
        outcome = solved_or_refused(lambda: calibrate_pairs(changed.pairs, changed.camera, self._options()))
        return Solved(outcome, changed.camera_from_radar)

    def _rig(self, rng: np.random.Generator) -> Rig:
        if self.apart_m:
            return random_rig_apart(rng, camera=study_camera(), distance_m=self.apart_m)
        return random_rig(rng, camera=study_camera())

    def _options(self) -> CalibrationOptions:
        solving = replace(self.options.solving, camera_position=tape_measured(self.tape_m).camera_position)
        if self.apart_m:
            solving = replace(solving, nominal_camera_distance_m=self.apart_m)
        return replace(self.options, solving=solving)


def generator(key: str, trial: int) -> np.random.Generator:
    """Return the generator of one trial of a row: rows have independent draws."""
    return np.random.default_rng([2040, zlib.crc32(key.encode()), trial])


def draw_flat(
    rng: np.random.Generator, count: int, *, noise: NoiseName, errors: SystematicErrors = FLAT
) -> SimulatedPairs:
    """Draw pairs of a radar without elevation, with its tilt and height drawn so that all placements are in view."""
    for _ in range(200):
        options = draw_flat_radar_rig(rng)
        rig = random_rig(rng, camera=study_camera(), options=options)
        try:
            return simulate_pairs(count, rng=rng, noise=noise, rig=rig, systematic=errors)
        except OptionError:  # the camera looks away from the ground
            continue
    raise OptionError(f"no tilt and height with {count} placements in view")
