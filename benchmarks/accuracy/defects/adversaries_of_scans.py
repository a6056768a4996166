"""Defects of scans and scenes that were seen to make a confident answer wrong: solved from clicks and returns."""

from dataclasses import dataclass, replace

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.defects.adversaries import Adversary, Solved, generator
from benchmarks.accuracy.scenes import Scene, draw_windows
from calib_core.calibration import calibrate
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate

_COARSE = (0.15, 0.026, 0.052)  # 15 cm, 1.5 deg, 3 deg
_ANOTHER = ("uncertain-association", "two-poses", "one-pair-decides")
_FIRST_SEED = 880_001
_RATE_HZ = 5.0  # half the usual rate, for speed


@dataclass(frozen=True, slots=True)
class _Windows:
    """A scene, and whether the camera position is given."""

    key: str
    scene: Scene
    tape_m: float | None = None
    clicked_twice: bool = False
    """Two clicks of every moment, as of two reflectors of which only one is there."""

    def __call__(self, trial: int) -> Solved:
        """Draw one trial and solve it."""
        rng = generator(self.key, trial)
        windows = draw_windows(self.scene, rng)
        clicks = windows.clicks
        if self.clicked_twice:
            away_px = 150.0 * rng.standard_normal((len(clicks), 2))
            clicks = (*clicks, *(_second(click, *away) for click, away in zip(clicks, away_px.tolist(), strict=True)))
        options = CalibrationOptions(solving=tape_measured(self.tape_m))
        return Solved(calibrate(clicks, windows.scans, windows.rig.camera, options), windows.rig.camera_from_radar)


def _second(click: ReflectorClick, right_px: float, down_px: float) -> ReflectorClick:
    return replace(click, id=f"{click.id}-b", u_px=click.u_px + right_px, v_px=click.v_px + down_px)


def _heavy_aisle(trial: int) -> Solved:
    """Solve a simulated session in a cluttered aisle with its own clicks."""
    options = SimulationOptions(seed=_FIRST_SEED + trial, scene="aisle", clutter="heavy", radar_rate_hz=_RATE_HZ)
    simulated = simulate(options)
    return Solved(
        calibrate(simulated.clicks, simulated.scans, simulated.camera, CalibrationOptions()),
        simulated.camera_from_radar,
    )


def _row(finding: str, codes: tuple[str, ...], windows: _Windows) -> Adversary:
    known = "free" if windows.tape_m is None else "tape"
    return Adversary(windows.key, f"{finding}, {windows.scene.radar}, 20, {known}", codes, windows)


ADVERSARIES_OF_SCANS: tuple[Adversary, ...] = (
    Adversary(
        "heavy-aisle",
        "session in an aisle with strong invisible objects, awr1843, 20, free",
        (*_ANOTHER, "weak-geometry"),
        _heavy_aisle,
    ),
    _row(
        "radar that scatters by 15 cm, 1.5 and 3 deg",
        (),
        _Windows("coarse-free", Scene("coarse", objects=3, rcs_dbsm=(3.0, 9.0), scatter=_COARSE)),
    ),
    _row(
        "cart 1 m behind every reflector",
        _ANOTHER,
        _Windows("cart-free", Scene("cart", objects=3, rcs_dbsm=(3.0, 9.0), companion_dbsm=18.0)),
    ),
    _row(
        "16 objects stronger than the reflector",
        _ANOTHER,
        _Windows("busy-free", Scene("busy", objects=16, rcs_dbsm=(14.0, 22.0), radar="imaging")),
    ),
    _row(
        "two clicks of every moment, one of them wrong",
        (*_ANOTHER, "many-outliers"),
        _Windows("same-moment-tape", Scene("same moment"), 0.01, clicked_twice=True),
    ),
)
