"""All options of the core. They define the flags, the page's fields and the provenance in exported files.

`checked_options` checks the type and range of each, for whoever sets them: a script, the page or the command line.
"""

import math
import numbers
import typing
from collections.abc import Iterator, Mapping
from dataclasses import Field, dataclass, field, fields, is_dataclass, replace
from functools import cache
from typing import Any, Literal, TypeAlias

from calib_core.errors import OptionError

Method: TypeAlias = Literal["default", "paper"]
"""The names of `METHODS`, in `calib_core.calibration`."""


def option(default: Any, text: str, *, low: float = -math.inf, high: float = math.inf) -> Any:
    """Make the field of an option; its text and range are kept in the field's metadata.

    Args:
        default: the value if it is not set.
        text: one sentence for users: the help of the flag and the hint on the page. The unit is in the field's name.
        low: the smallest allowed number.
        high: the largest allowed number.
    """
    return field(default=default, metadata={"help": text, "low": low, "high": high})


@dataclass(frozen=True, slots=True)
class GatingOptions:
    """Which returns can be the reflector."""

    max_speed_mps: float = option(
        0.05, "Largest absolute Doppler speed of a static return [m/s]; the paper keeps exactly 0.", low=0.0, high=100.0
    )
    min_range_m: float = option(0.5, "Nearest return kept [m].", low=0.0, high=1000.0)
    max_range_m: float = option(60.0, "Farthest return kept [m]; the paper uses 20.", low=0.1, high=1000.0)


@dataclass(frozen=True, slots=True)
class LocatingOptions:
    """How the returns around one click become candidates."""

    window_s: float = option(
        3.0, "Length of the window centered on the scan nearest to the click [s] (paper: 3 s).", low=0.01, high=60.0
    )
    max_candidates: int = option(
        16, "Largest number of candidates per click; fewer are kept where one return stands out.", low=1, high=50
    )
    max_time_gap_s: float = option(
        1.5, "A click farther than this from every scan stays unpaired [s].", low=0.0, high=60.0
    )


@dataclass(frozen=True, slots=True)
class NoiseOptions:
    """Standard deviations to use where the message gives none; the solver then estimates a scale factor for each."""

    sigma_px: float = option(2.0, "Standard deviation of a click, per axis [px].", low=0.01, high=1000.0)
    sigma_range_m: float = option(0.03, "Standard deviation of a placement's range [m].", low=1e-4, high=10.0)
    sigma_azimuth_deg: float = option(
        0.5,
        "Standard deviation of a placement's azimuth [deg], angle bins and calibration included; window scatter understates it.",
        low=1e-3,
        high=45.0,
    )
    sigma_elevation_deg: float = option(
        1.0, "Standard deviation of a placement's elevation [deg].", low=1e-3, high=45.0
    )
    estimate_scale: bool = option(
        True, "Estimate the noise level from the residuals (variance components) once there are enough pairs."
    )


@dataclass(frozen=True, slots=True)
class RadarOptions:
    """Systematic errors of the radar: prior standard deviations; 0 means exact."""

    azimuth_scale_sigma: float = option(
        0.02,
        "Standard deviation of the azimuth's scale, as a share (0.02 is 2 %): element spacing and wavelength are known roughly.",
        low=0.0,
        high=0.5,
    )
    elevation_scale_sigma: float = option(
        0.03, "Standard deviation of the elevation's scale, as a share (0.03 is 3 %).", low=0.0, high=0.5
    )
    elevation_lean_sigma: float = option(
        0.01,
        "Standard deviation of how far elevations lean with the azimuth [rad per rad]: a rolled or sheared antenna array.",
        low=0.0,
        high=0.5,
    )
    range_bias_sigma_m: float = option(0.03, "Standard deviation of a constant range error [m].", low=0.0, high=5.0)
    range_scale_sigma: float = option(0.003, "Standard deviation of the range's scale, as a share.", low=0.0, high=0.5)
    azimuth_bias_sigma_deg: float = option(
        1.0,
        "Standard deviation of a constant azimuth error [deg]; it is a rotation, so it counts only for the pose of the housing.",
        low=0.0,
        high=45.0,
    )
    elevation_bias_sigma_deg: float = option(
        1.0, "Standard deviation of a constant elevation error [deg]; likewise.", low=0.0, high=45.0
    )
    tilt_sigma_deg: float = option(
        10.0, "Standard deviation of the tilt of a radar that measures no elevation [deg].", low=0.0, high=45.0
    )
    height_sigma_m: float = option(
        1.0,
        "Standard deviation of the height of the placements above or below a radar that measures no elevation [m].",
        low=0.0,
        high=20.0,
    )


@dataclass(frozen=True, slots=True)
class LensOptions:
    """How far off the intrinsics may be: standard deviations; 0 means exact."""

    focal_length_sigma: float = option(
        0.003, "Standard deviation of the focal length, as a share (0.003 is 0.3 %).", low=0.0, high=0.5
    )
    principal_point_sigma_px: float = option(
        5.0,
        "Standard deviation of the principal point, per axis [px of an image 1920 px wide; scaled to the width].",
        low=0.0,
        high=1000.0,
    )
    distortion_sigma: float = option(
        0.005, "Standard deviation of the first radial distortion coefficient.", low=0.0, high=1.0
    )


@dataclass(frozen=True, slots=True)
class RefiningOptions:
    """Estimate the intrinsics with the pose; the sigmas say how far off they may be if they come without a covariance."""

    intrinsics: bool = option(
        False, "Estimate focal length, principal point and first radial distortion coefficient together with the pose."
    )
    focal_length_sigma: float = option(
        0.03,
        "Standard deviation of the focal length to be refined, as a share (0.03 is 3 %); fx and fy keep their ratio.",
        low=0.0,
        high=0.5,
    )
    principal_point_sigma_px: float = option(
        10.0,
        "Standard deviation of the principal point to be refined, per axis [px of an image 1920 px wide; scaled to the width].",
        low=0.0,
        high=1000.0,
    )
    distortion_sigma: float = option(
        0.01, "Standard deviation of the first radial distortion coefficient to be refined.", low=0.0, high=1.0
    )


@dataclass(frozen=True, slots=True)
class ReflectorOptions:
    """Systematic errors of the clicks: prior standard deviations; 0 means exact."""

    offset_sigma_m: float = option(
        0.02,
        "Standard deviation of the clicked point from the radar's phase center, per camera axis [m]; a mouth is 0.1 m off.",
        low=0.0,
        high=1.0,
    )
    click_offset_sigma_px: float = option(
        2.0, "Standard deviation of a constant click offset, per axis [px].", low=0.0, high=100.0
    )


HowMeasured: TypeAlias = Literal["housing", "antenna", "drawing"]
HOW_MEASURED: Mapping[HowMeasured, tuple[str, float]] = {
    "housing": ("from housing to housing", 0.05),
    "antenna": ("from the antennas to the lens", 0.02),
    "drawing": ("from a drawing", 0.005),
}
"""How a camera position was measured: in words, and the standard deviation per axis [m] that it then has."""


@dataclass(frozen=True, slots=True)
class CameraPositionPrior:
    """A tape-measured camera position; no other extra measurement helps as much. It may be off by more than its sigma says."""

    position_m: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), "Camera center in the radar frame: forward, left, up [m].", low=-100.0, high=100.0
    )
    sigma_m: float = option(0.03, "Standard deviation of that position, per axis [m].", low=1e-4, high=10.0)

    @classmethod
    def measured(cls, position_m: tuple[float, float, float], how: HowMeasured) -> "CameraPositionPrior":
        """Return a position that was measured in one of the ways of `HOW_MEASURED`, with the sigma that this has."""
        return cls(position_m, HOW_MEASURED[how][1])


@dataclass(frozen=True, slots=True)
class SolvingOptions:
    """How pairs become a pose (default method)."""

    camera_position: CameraPositionPrior | None = option(None, "Tape-measured camera position, if known.")
    nominal_camera_distance_m: float = option(
        1.0,
        "Rough distance between the sensors [m]: a wide prior, only to distinguish a pose from its mirror image.",
        low=0.01,
        high=100.0,
    )
    rig_size_m: float = option(
        3.0,
        "Largest distance between the sensors [m]: another pose with the camera farther away is no answer; 30 for two rigs.",
        low=0.01,
        high=1000.0,
    )
    sensors_above_placements: bool = option(
        True,
        "Radar and camera are on the same side of the plane of the placements, as above a floor; this tells mirrored axes.",
    )
    seed: int = option(1, "Seed of the random generator; the same seed gives the same bytes.", low=0, high=2**32 - 1)

    @property
    def reach_m(self) -> float:
        """How far apart the sensors can be [m]: as far as the rig is large, or twice as far as they are expected to be."""
        return max(self.rig_size_m, 2.0 * self.nominal_camera_distance_m)


@dataclass(frozen=True, slots=True)
class PaperOptions:
    """What Algorithm 1 of the paper does not specify."""

    z_score_threshold: float = option(
        1.0, "Largest absolute z-score per axis of a return to be averaged; the authors use 1.", low=0.01, high=100.0
    )
    z_score_axes: Literal["separately", "in-turn"] = option(
        "separately",
        "Filter each axis over the whole window, or as the authors do: y on the returns that x keeps, z on those that y keeps.",
    )
    window: Literal["centred", "whole-second"] = option(
        "centred",
        "Centered on the nearest stamp as in the paper, or as the authors do: 1 s on either side of that stamp's whole second.",
    )
    window_s: float = option(3.0, "Length of the centered window [s].", low=0.01, high=60.0)
    region_m: float = option(
        1.0,
        "Placement range [m]: returns farther from the placement are left out before the z-score; 0: none, as printed.",
        low=0.0,
        high=100.0,
    )
    max_range_m: float = option(20.0, "Range filter of Algorithm 1 [m].", low=0.1, high=1000.0)
    max_speed_mps: float = option(
        0.0, "Velocity filter of Algorithm 1 [m/s]: exactly 0 in the paper.", low=0.0, high=100.0
    )
    ransac_threshold_px: float = option(
        8.0,
        "Largest reprojection error of a RANSAC inlier [px]; not in the paper, the authors use OpenCV's 8.",
        low=0.01,
        high=1000.0,
    )
    ransac_iterations: int = option(
        10_000,
        "RANSAC iterations; not in the paper, the authors use 10,000 for the iterative solver.",
        low=1,
        high=1_000_000,
    )
    ransac_confidence: float = option(0.99, "RANSAC stops early at this confidence.", low=0.01, high=0.999999)


@dataclass(frozen=True, slots=True)
class MountingOptions:
    """How the camera is mounted on the radar, nominally: turned by roll, then pitch, then yaw about the radar's axes."""

    roll_deg: float = option(0.0, "How far the camera leans to its right [deg].", low=-180.0, high=180.0)
    pitch_deg: float = option(
        0.0, "How far the camera looks down from the radar's direction [deg].", low=-90.0, high=90.0
    )
    yaw_deg: float = option(
        0.0, "How far the camera looks to the left of the radar's direction [deg].", low=-180.0, high=180.0
    )


@dataclass(frozen=True, slots=True)
class CalibrationOptions:
    """All options of a calibration."""

    method: Method = option(
        "default",
        "The robust estimator, or the paper's Algorithm 1, which weighs nothing, leaves no wrong pair out and states no error.",
    )
    gating: GatingOptions = field(default_factory=GatingOptions)
    locating: LocatingOptions = field(default_factory=LocatingOptions)
    noise: NoiseOptions = field(default_factory=NoiseOptions)
    radar: RadarOptions = field(default_factory=RadarOptions)
    lens: LensOptions = field(default_factory=LensOptions)
    reflector: ReflectorOptions = field(default_factory=ReflectorOptions)
    solving: SolvingOptions = field(default_factory=SolvingOptions)
    paper: PaperOptions = field(default_factory=PaperOptions)
    mounting: MountingOptions = field(default_factory=MountingOptions)
    refining: RefiningOptions = field(default_factory=RefiningOptions)

    @property
    def models_noise(self) -> bool:
        """Whether the method has a noise model: it weighs pairs, states a covariance, and can refine the intrinsics."""
        return self.method == "default"


LensChoice: TypeAlias = Literal["auto", "pinhole", "plumb_bob", "rational_polynomial", "equidistant"]
"""A lens model; auto takes the simplest that predicts views it has not seen as well as any."""


def without_systematic_errors(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options of exact instruments: every prior of a systematic error 0, and no intrinsics to refine."""
    radar = RadarOptions(**{entry.name: 0.0 for entry in fields(RadarOptions)})
    lens = LensOptions(**{entry.name: 0.0 for entry in fields(LensOptions)})
    reflector = ReflectorOptions(**{entry.name: 0.0 for entry in fields(ReflectorOptions)})
    return replace(options, radar=radar, lens=lens, reflector=reflector, refining=RefiningOptions())


OptionKind: TypeAlias = Literal["number", "integer", "yes-no", "choice", "camera-position"]
UNITS = {"_mps": "m/s", "_px": "px", "_deg": "deg", "_rad": "rad", "_db": "dB", "_m": "m", "_s": "s"}


@dataclass(frozen=True, slots=True)
class OptionField:
    """One option.

    Attributes:
        path: its name, such as "noise.sigma_px".
        owner: the dataclass it belongs to.
        field: with its text and range.
        type: of its value.
    """

    path: str
    owner: type
    field: Field[Any]
    type: Any


def checked_options(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options unchanged if every value is valid.

    Raises:
        OptionError: a number is not finite or out of range, a choice is unknown, or two options contradict each other.
    """
    if not isinstance(options, CalibrationOptions):
        raise OptionError(f"options: expected CalibrationOptions, got {type(options).__name__}")
    for leaf in option_fields().values():
        group = leaf.path.rpartition(".")[0]
        value = getattr(getattr(options, group) if group else options, leaf.field.name)
        for name, number in _numbers(leaf.path, value):
            low, high = RANGES[name]
            if not (math.isfinite(number) and low <= number <= high):
                raise OptionError(
                    f"option {name}: {number:g} is out of range; allowed: {low:g} to {high:g}{_unit_after(name)}"
                    + _other_units(name, number)
                )
        _check_type(leaf, value)
    if options.gating.min_range_m >= options.gating.max_range_m:
        raise OptionError(
            f"option gating.min_range_m: {options.gating.min_range_m:g} m is not below "
            f"gating.max_range_m, {options.gating.max_range_m:g} m; make it smaller"
        )
    if options.refining.intrinsics:
        _check_refining(options)
    return options


def _check_refining(options: CalibrationOptions) -> None:
    """Refuse to refine the intrinsics where they cannot be.

    Raises:
        OptionError: the method takes them as they are, or every standard deviation is 0.
    """
    if not options.models_noise:
        raise OptionError(
            f"option refining.intrinsics: the method {options.method} takes the intrinsics as they are and cannot refine "
            "them; use the method default, or turn refining off"
        )
    refining = options.refining
    if not (refining.focal_length_sigma or refining.principal_point_sigma_px or refining.distortion_sigma):
        raise OptionError(
            "option refining.intrinsics: every standard deviation of refining is 0, so there is nothing to refine; state "
            "how far off the focal length, the principal point or the distortion may be"
        )


_WANTED: Mapping[str, tuple[type, str]] = {
    "number": (numbers.Real, "a number"),
    "integer": (numbers.Integral, "a whole number"),
    "yes-no": (bool, "True or False"),
}


def _check_type(leaf: OptionField, value: object) -> None:
    """Refuse a value of another type than the option's, or none of its choices.

    Raises:
        OptionError: names the option and the value.
    """
    kind = kind_of(leaf)
    if kind == "choice" and value not in typing.get_args(leaf.type):
        choices = " or ".join(typing.get_args(leaf.type))
        raise OptionError(f"option {leaf.path}: unknown value '{value}'; choose {choices}")
    if kind == "camera-position":
        words = "a CameraPositionPrior or None"
        fits = value is None or isinstance(value, CameraPositionPrior)
    elif kind in _WANTED:
        wanted, words = _WANTED[kind]
        fits = isinstance(value, wanted) and (kind == "yes-no" or not isinstance(value, bool))
    else:
        return
    if not fits:
        raise OptionError(f"option {leaf.path}: expected {words}, got {value!r}")


@cache
def option_fields() -> Mapping[str, OptionField]:
    """Return every option that can be set on its own, by path; a camera position is set as a whole."""
    leaves: dict[str, OptionField] = {}
    top = typing.get_type_hints(CalibrationOptions)
    for top_field in fields(CalibrationOptions):
        group = top[top_field.name]
        if not is_dataclass(group):
            leaves[top_field.name] = OptionField(top_field.name, CalibrationOptions, top_field, group)
            continue
        hints = typing.get_type_hints(group)
        for entry in fields(group):
            path = f"{top_field.name}.{entry.name}"
            leaves[path] = OptionField(path, typing.cast(type, group), entry, hints[entry.name])
    return leaves


def _ranges() -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the range of every number, under the name that `_numbers` gives it."""
    for leaf in option_fields().values():
        if kind_of(leaf) in ("number", "integer"):
            yield leaf.path, (leaf.field.metadata["low"], leaf.field.metadata["high"])
        elif kind_of(leaf) == "camera-position":
            for part in fields(CameraPositionPrior):
                yield f"{leaf.path}.{part.name}", (part.metadata["low"], part.metadata["high"])


@cache
def kind_of(leaf: OptionField) -> OptionKind:
    """Return what kind of value an option takes."""
    if typing.get_origin(leaf.type) is Literal:
        return "choice"
    if leaf.type == CameraPositionPrior | None:
        return "camera-position"
    return {bool: "yes-no", int: "integer", float: "number"}[leaf.type]  # type: ignore[return-value]


def _numbers(path: str, value: object) -> Iterator[tuple[str, float]]:
    """Yield the numbers in an option's value, each with the name of its range."""
    if isinstance(value, CameraPositionPrior):
        for number in value.position_m:
            yield f"{path}.position_m", number
        yield f"{path}.sigma_m", value.sigma_m
    elif isinstance(value, numbers.Real) and not isinstance(value, bool):
        yield path, float(value)


def unit_of_name(name: str) -> str:
    """Return the unit that a name ends with, such as "m/s" for max_speed_mps; "" without one."""
    return next((unit for suffix, unit in UNITS.items() if name.endswith(suffix)), "")


def _unit_after(path: str) -> str:
    unit = unit_of_name(path)
    return f" {unit}" if unit else ""


def _other_units(name: str, number: float) -> str:
    """Say what a length that is out of range would be if it was given in centimeters or millimeters; "" if it is no such."""
    low, high = RANGES[name]
    size = abs(number)
    if unit_of_name(name) != "m" or size <= high or not low <= number / 1000 <= high:
        return ""
    metres = f" or {number / 100:g}" if size / 100 <= high else ""
    return f". Give meters: {number / 1000:g}{metres}, if it is in millimeters{' or centimeters' if metres else ''}"


RANGES: Mapping[str, tuple[float, float]] = dict(_ranges())
"""The smallest and largest allowed value of each number, from the options' fields."""
