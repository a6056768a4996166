"""All options of the core. They define the flags, the page's fields and the provenance in exported files."""

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal, TypeAlias

Method: TypeAlias = Literal["default", "paper"]
"""The names of `METHODS`, in `calib_core.calibration`."""
RETIRED_METHODS = ("pmm", "ccm")
"""Methods of older versions. Calibrations that were made by them are still read, and cannot be solved again by them."""


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
        3.0, "Length of the window centred on the scan nearest to the click [s] (paper: 3 s).", low=0.01, high=60.0
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
    """What a radar gets wrong at every placement alike: standard deviations before any pair; 0 means exact."""

    azimuth_scale_sigma: float = option(
        0.02,
        "Standard deviation of the azimuth's scale, as a share (0.02 is 2 %): element spacing and wavelength are known roughly.",
        low=0.0,
        high=0.5,
    )
    elevation_scale_sigma: float = option(
        0.03, "Standard deviation of the elevation's scale, as a share (0.03 is 3 %).", low=0.0, high=0.5
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
        "Standard deviation of the principal point, per axis [px of a picture 1920 px wide; scaled to the width].",
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
        "Standard deviation of the principal point to be refined, per axis [px of a picture 1920 px wide; scaled to the width].",
        low=0.0,
        high=1000.0,
    )
    distortion_sigma: float = option(
        0.01, "Standard deviation of the first radial distortion coefficient to be refined.", low=0.0, high=1.0
    )


@dataclass(frozen=True, slots=True)
class ReflectorOptions:
    """What is wrong with every click alike: standard deviations before any pair; 0 means exact."""

    offset_sigma_m: float = option(
        0.02,
        "Standard deviation of the clicked point from the radar's phase centre, per camera axis [m]; a mouth is 0.1 m off.",
        low=0.0,
        high=1.0,
    )
    click_offset_sigma_px: float = option(
        2.0, "Standard deviation of what one person's clicks are all off by, per axis [px].", low=0.0, high=100.0
    )


@dataclass(frozen=True, slots=True)
class CameraPositionPrior:
    """A tape-measured camera position; no other extra measurement helps as much."""

    position_m: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0), "Camera centre in the radar frame: forward, left, up [m].", low=-100.0, high=100.0
    )
    sigma_m: float = option(0.01, "Standard deviation of that position, per axis [m].", low=1e-4, high=10.0)


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
    sensors_above_placements: bool = option(
        True,
        "Radar and camera are on the same side of the plane of the placements, as above a floor; this tells mirrored axes.",
    )
    seed: int = option(1, "Seed of the random generator; the same seed gives the same bytes.", low=0, high=2**32 - 1)


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
        "Centred on the nearest stamp as in the paper, or as the authors do: 1 s on either side of that stamp's whole second.",
    )
    window_s: float = option(3.0, "Length of the centred window [s].", low=0.01, high=60.0)
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
        "The robust estimator, or the paper's Algorithm 1 as printed.",
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


def without_systematic_errors(options: CalibrationOptions) -> CalibrationOptions:
    """Return the options of exact instruments: every prior of a systematic error 0, and no intrinsics to refine."""
    radar = RadarOptions(**{one.name: 0.0 for one in fields(RadarOptions)})
    lens = LensOptions(**{one.name: 0.0 for one in fields(LensOptions)})
    reflector = ReflectorOptions(**{one.name: 0.0 for one in fields(ReflectorOptions)})
    return replace(options, radar=radar, lens=lens, reflector=reflector, refining=RefiningOptions())
