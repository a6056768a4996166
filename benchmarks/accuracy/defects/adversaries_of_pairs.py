"""The rows of the adversarial table that are drawn as pairs: defects that were seen to make a confident answer wrong."""

from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.accuracy.cases import tape_measured
from benchmarks.accuracy.defects.adversaries import FLAT, Adversary, Change, Draw, Solved, draw_flat, generator
from benchmarks.accuracy.defects.pair_defects import (
    clicked_again,
    from_moved_camera,
    in_other_units,
    lowered,
    mirrored,
    with_angles,
    with_clicks_on_drawn_returns,
    with_companion,
    with_ground_bounce,
    with_rounded_elevations,
    with_sheared_array,
    with_squeezed_rows,
    with_zero_pair,
)
from benchmarks.simulated_pairs import AISLE, NoiseName, SimulatedPairs, SystematicErrors, simulate_pairs
from calib_core.calibration import calibrate_pairs
from calib_core.options import CalibrationOptions, CameraPositionPrior
from calib_core.synthetic.scene.scenes import PairsLayout

_TAPE_M = 0.01
_RIGHT_M = 0.02
_FREE_AISLE = PairsLayout(max_range_m=20.0, max_lateral_m=1.0)
_TRIPODS = PairsLayout(height_m=0.5, max_height_m=1.5)


def _flat(key: str, noise: NoiseName, pairs: int, tape_m: float | None, trial: int) -> Solved:
    simulated = draw_flat(generator(key, trial), pairs, noise=noise)
    options = CalibrationOptions(solving=tape_measured(tape_m))
    return Solved(calibrate_pairs(simulated.pairs, simulated.camera, options), simulated.camera_from_radar)


def _tape_off(key: str, noise: NoiseName, off_m: float, trial: int) -> Solved:
    """Solve with a camera position that was measured wrong, in any direction."""
    rng = generator(key, trial)
    simulated = simulate_pairs(20, rng=rng, noise=noise, outlier_share=0.1)
    direction = rng.standard_normal(3)
    told_m = simulated.rig.camera_position_radar_m + off_m * direction / np.linalg.norm(direction)
    prior = CameraPositionPrior((float(told_m[0]), float(told_m[1]), float(told_m[2])), _TAPE_M)
    options = CalibrationOptions(solving=replace(tape_measured(_TAPE_M), camera_position=prior))
    return Solved(calibrate_pairs(simulated.pairs, simulated.camera, options), simulated.camera_from_radar)


def _again(clicks: int) -> Change:
    return lambda simulated, rng: clicked_again(simulated, clicks, rng=rng)


def _companion(share: float, *, seen: bool) -> Change:
    return lambda simulated, rng: with_companion(simulated, rng=rng, wander_m=0.03, share=share, reflector_seen=seen)


def _moved(share: float, turn_deg: float) -> Change:
    return lambda simulated, rng: from_moved_camera(simulated, rng=rng, share=share, turn_deg=turn_deg)


def _turned(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    """Turn the camera after the first half of the pairs, which are numbered in their order."""
    return from_moved_camera(simulated, rng=rng, share=0.5, turn_deg=2.0, in_order=True)


def _mirror(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return mirrored(simulated)


def _units(per_metre: float) -> Change:
    return lambda simulated, rng: in_other_units(simulated, per_metre)


def _sheared(shear_deg: float) -> Change:
    return lambda simulated, rng: with_sheared_array(simulated, shear_deg)


def _sine(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_angles(simulated, lambda polar: np.column_stack([polar[:, 0], np.sin(polar[:, 1]), polar[:, 2]]))


def _halved(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_angles(simulated, lambda polar: polar * np.array([1.0, 1.0, 0.5]))


def _on_drawn(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_clicks_on_drawn_returns(simulated, rng=rng, turn_deg=3.0)


def _squeezed(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_squeezed_rows(simulated, 0.9)


def _lower(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return lowered(simulated, 0.4)


def _bounce(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_ground_bounce(simulated, rng=rng)


def _rounded(simulated: SimulatedPairs, rng: np.random.Generator) -> SimulatedPairs:
    return with_rounded_elevations(simulated, rng=rng)


def _rows(
    finding: str,
    codes: tuple[str, ...],
    *draws: Draw,
    always_wrong: bool = False,
    trusted: tuple[float, float] | None = None,
    gauge: bool = False,
) -> tuple[Adversary, ...]:
    """Make one row of each draw, with the same finding and codes."""
    return tuple(
        Adversary(draw.key, f"{finding}, {_told(draw)}", codes, draw, always_wrong, trusted, gauge) for draw in draws
    )


def _told(draw: Draw) -> str:
    apart = f", {draw.apart_m:g} m apart" if draw.apart_m else ""
    return f"{draw.noise}, {draw.pairs}, {'free' if draw.tape_m is None else 'tape'}{apart}"


_MODES = ("agreeing-outliers", "one-pair-decides", "two-poses")
_HAND = ("mirrored-axes", "handedness-open")
_LENS = ("angle-scale", "intrinsics-suspected")
_TAPE = ("camera-position-contradicted", "camera-position-doubtful")
_UNITS = ("units-suspected", *_TAPE)

_SHARED = (
    *_rows(
        "azimuths 3 % too large",
        (),
        Draw("scale-imaging-free-20", errors=SystematicErrors(azimuth_scale=0.03)),
        Draw("scale-imaging-free-85", pairs=85, errors=SystematicErrors(azimuth_scale=0.03)),
        Draw("scale-ti-free-20", "ti", errors=SystematicErrors(azimuth_scale=0.03)),
        Draw("scale-ti-tape-40", "ti", 40, _TAPE_M, SystematicErrors(azimuth_scale=0.03)),
    ),
    *_rows(
        "all shared errors, drawn from the priors",
        (),
        Draw("priors-imaging-free", errors=None),
        Draw("priors-imaging-tape", pairs=12, tape_m=_TAPE_M, errors=None),
        Draw("priors-ti-free", "ti", errors=None),
    ),
    *_rows(
        "ranges 12 cm too long",
        (),
        Draw("range-imaging-free", errors=SystematicErrors(range_bias_m=0.12)),
        Draw("range-ti-tape", "ti", tape_m=_TAPE_M, errors=SystematicErrors(range_bias_m=0.12)),
    ),
    *_rows(
        "clicks 6 px low",
        (),
        Draw("low-px-imaging-free", errors=SystematicErrors(click_offset_px=(0.0, 6.0))),
        Draw("low-px-imaging-tape", tape_m=_TAPE_M, errors=SystematicErrors(click_offset_px=(0.0, 6.0))),
    ),
    *_rows(
        "clicks 10 cm below the phase center",
        (),
        Draw("low-m-imaging-free", errors=SystematicErrors(reflector_offset_m=(0.0, 0.1, 0.0))),
        Draw("low-m-imaging-tape", tape_m=_TAPE_M, errors=SystematicErrors(reflector_offset_m=(0.0, 0.1, 0.0))),
    ),
    *_rows(
        "principal point 15 px off",
        _LENS,
        Draw("principal-15-imaging-free", errors=SystematicErrors(principal_point_px=(15.0, 0.0))),
        Draw("principal-15-ti-tape", "ti", tape_m=_TAPE_M, errors=SystematicErrors(principal_point_px=(9.0, -12.0))),
    ),
    *_rows(
        "array sheared by 0.5 deg",
        (),
        Draw("shear-imaging-free", change=_sheared(0.5)),
        Draw("shear-ti-tape", "ti", tape_m=_TAPE_M, change=_sheared(0.5)),
    ),
    *_rows(
        "ground bounce at tripods of 0.5 to 1.5 m",
        (),
        Draw("bounce-ti-free", "ti", layout=_TRIPODS, change=_bounce),
        Draw("bounce-ti-tape", "ti", tape_m=_TAPE_M, layout=_TRIPODS, change=_bounce),
    ),
    *_rows(
        "principal point 30 px off",
        _LENS,
        Draw("principal-imaging-free", errors=SystematicErrors(principal_point_px=(30.0, 0.0))),
        Draw("principal-imaging-tape", tape_m=_TAPE_M, errors=SystematicErrors(principal_point_px=(18.0, -24.0))),
    ),
    *_rows(
        "focal length 2 % too long",
        _LENS,
        Draw("focal-ti-free", "ti", errors=SystematicErrors(focal_length=0.02)),
        Draw("focal-imaging-tape", tape_m=_TAPE_M, errors=SystematicErrors(focal_length=0.02)),
    ),
)
_ANGLES = (
    "angle-scale",
    "shared-error-suspected",
    "intrinsics-suspected",
    "smooth-angle-errors",
    "residuals-too-large",
)
_OF_ANGLES = (
    *_rows(
        "azimuths reported as their sine",
        _ANGLES,
        Draw("sine-imaging-free", errors=None, change=_sine),
        Draw("sine-ti-tape", "ti", tape_m=_TAPE_M, errors=None, change=_sine),
    ),
    *_rows(
        "elevations reported by half, tripods of 0.5 to 1.5 m",
        (*_ANGLES, *_TAPE),
        Draw("halved-imaging-free", errors=None, layout=_TRIPODS, change=_halved),
        Draw("halved-imaging-tape", tape_m=_TAPE_M, errors=None, layout=_TRIPODS, change=_halved),
        Draw("halved-ti-free", "ti", errors=None, layout=_TRIPODS, change=_halved),
    ),
    *_rows(
        "camera turned by 2 deg half-way, no times",
        ("shared-error-suspected", "agreeing-outliers", "two-poses", "many-outliers", "residuals-too-large"),
        Draw("turned-imaging-free", change=_turned),
        Draw("turned-ti-free", "ti", change=_turned),
    ),
)
_HEIGHT = SystematicErrors(measures_elevation=False, constant_z_m=0.5)
_TWO_DIMENSIONAL = (
    *_rows(
        "2D radar that reports its height as z",
        (),
        Draw("flat-z-ti-free", "ti", errors=_HEIGHT),
        Draw("flat-z-imaging-free", errors=_HEIGHT),
    ),
    *_rows("2D radar, elevations of 1e-6 rad", (), Draw("flat-rounded-ti-free", "ti", errors=FLAT, change=_rounded)),
    *_rows(
        "2D radar, tilted by 10 deg, 1.2 m high",
        (),
        Draw("flat-tilt-ti-free", "ti", errors=FLAT),
        Draw("flat-tilt-imaging-tape", tape_m=_TAPE_M, errors=FLAT),
    ),
    Adversary(
        "flat-drawn-ti-5",
        "2D radar, tilt and height drawn, ti, 5, free",
        (),
        partial(_flat, "flat-drawn-ti-5", "ti", 5, None),
    ),
    Adversary(
        "flat-drawn-imaging-15",
        "2D radar, tilt and height drawn, imaging, 15, free",
        (),
        partial(_flat, "flat-drawn-imaging-15", "imaging", 15, None),
    ),
)
_CLICKING = (
    *_rows(
        "three clicks of every placement",
        (),
        Draw("thrice-ti-free", "ti", 12, change=_again(3)),
        Draw("thrice-imaging-free", pairs=12, change=_again(3)),
    ),
    *_rows(
        "two clicks of every placement in a cluttered aisle",
        ("weak-geometry",),
        Draw("twice-aisle-tape", "ti_aisle", 20, _TAPE_M, outlier_share=0.3, layout=AISLE, change=_again(2)),
    ),
    *_rows(
        "wrong pairs, one of which may agree",
        _MODES,
        Draw("agreeing-ti-20", "ti", outlier_share=0.3),
        Draw("agreeing-imaging-20", outlier_share=0.3),
        Draw("agreeing-imaging-12", pairs=12, outlier_share=0.3),
    ),
    *_rows(
        "half of the pairs from before the camera was turned by 4 deg",
        ("agreeing-outliers", "two-poses", "many-outliers"),
        Draw("group-imaging-tape", tape_m=_TAPE_M, change=_moved(0.5, 4.0)),
        Draw("group-ti-free", "ti", 40, change=_moved(0.5, 4.0)),
    ),
    *_rows(
        "narrow aisle with wrong pairs",
        (*_MODES, "weak-geometry"),
        Draw("aisle-20", "ti_aisle", outlier_share=0.3, layout=_FREE_AISLE),
        Draw("aisle-40", "ti_aisle", 40, outlier_share=0.5, layout=_FREE_AISLE),
    ),
    *_rows(
        "stronger object 1 m behind each reflector",
        ("agreeing-outliers", "uncertain-association", "two-poses"),
        Draw("companion-imaging-free", change=_companion(1.0, seen=True)),
        Draw("companion-ti-tape", "ti", tape_m=_TAPE_M, change=_companion(1.0, seen=True)),
    ),
    *_rows(
        "object 1 m behind half of the reflectors hides them",
        ("agreeing-outliers", "two-poses", "many-outliers"),
        Draw("hidden-imaging-free", change=_companion(0.5, seen=False)),
    ),
)
_INPUT = (
    *_rows(
        "mirrored radar",
        _HAND,
        Draw("mirrored-imaging-free", change=_mirror),
        Draw("mirrored-ti-free", "ti", change=_mirror),
        Draw("mirrored-imaging-apart", apart_m=8.0, change=_mirror),
        Draw("mirrored-ti-apart", "ti", apart_m=8.0, change=_mirror),
        always_wrong=True,
    ),
    *_rows("right radar far from the camera", _HAND, Draw("apart-imaging-free", apart_m=8.0)),
    Adversary(
        "tape-off-ti",
        "camera position 0.3 m off, ti, 20, tape",
        _TAPE,
        partial(_tape_off, "tape-off-ti", "ti", 0.3),
    ),
    Adversary(
        "tape-off-imaging",
        "camera position 0.3 m off, imaging, 20, tape",
        _TAPE,
        partial(_tape_off, "tape-off-imaging", "imaging", 0.3),
    ),
    *_rows(
        "radar positions in millimeters",
        _UNITS,
        Draw("millimetres-tape", "ti", tape_m=_TAPE_M, change=_units(1000.0)),
        Draw("millimetres-free", "ti", change=_units(1000.0)),
        always_wrong=True,
    ),
    *_rows(
        "radar positions in centimeters",
        _UNITS,
        Draw("centimetres-tape", "ti", tape_m=_TAPE_M, change=_units(100.0)),
        always_wrong=True,
    ),
    *_rows(
        "radar positions in feet",
        _UNITS,
        Draw("feet-tape", "ti", tape_m=_TAPE_M, change=_units(3.2808)),
    ),
    *_rows("one radar position 1 mm from the origin", (), Draw("origin-imaging-free", change=with_zero_pair)),
    *_rows(
        "method paper on a good set",
        ("few-pairs", "many-outliers", "residuals-too-large", "behind-camera", "weak-geometry"),
        Draw("paper-ti-free", "ti", options=CalibrationOptions(method="paper")),
        Draw("paper-imaging-free", options=CalibrationOptions(method="paper")),
        trusted=(1.0, 0.25),
    ),
)


def _gauge(
    finding: str, key: str, errors: SystematicErrors, change: Change | None = None, *, codes: tuple[str, ...] = _TAPE
) -> tuple[Adversary, ...]:
    """Make a row of each radar, without and with a camera position that is right."""
    draws = (
        Draw(f"gauge-{key}-{noise}-{known}", noise, tape_m=tape_m, errors=errors, change=change)
        for noise in _RADARS
        for known, tape_m in (("free", None), ("tape", _RIGHT_M))
    )
    return _rows(finding, codes, *draws, gauge=True)


_RADARS: tuple[NoiseName, ...] = ("ti", "imaging")
_GAUGES = (
    *_gauge("the stand's head clicked, 30 cm up", "head", SystematicErrors(reflector_offset_m=(0.0, -0.3, 0.0))),
    *_gauge("the person clicked, 40 cm aside", "person", SystematicErrors(reflector_offset_m=(0.4, 0.0, 0.0))),
    *_gauge("elevations pulled to the ground, 40 cm", "ground", SystematicErrors(), _lower),
    *_gauge(
        "image cropped by 200 rows",
        "cropped",
        SystematicErrors(principal_point_px=(0.0, 200.0)),
        codes=(*_TAPE, "intrinsics-suspected"),
    ),
    *_gauge("elevations reported by half, all on the ground", "halved", SystematicErrors(), _halved),
    *_gauge("clicks where a pose 3 deg off draws the returns", "drawn", SystematicErrors(), _on_drawn),
    *_gauge("image rows squeezed to 0.9", "squeezed", SystematicErrors(), _squeezed, codes=(*_TAPE, "angle-scale")),
    *_gauge("array sheared by 2 deg", "shear", SystematicErrors(), _sheared(2.0)),
)
ADVERSARIES_OF_PAIRS: tuple[Adversary, ...] = (*_SHARED, *_OF_ANGLES, *_TWO_DIMENSIONAL, *_CLICKING, *_INPUT, *_GAUGES)
