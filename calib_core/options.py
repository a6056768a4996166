"""Every option of the core, once: these are the flags, the page's fields and the provenance in the exported file."""

from dataclasses import dataclass, field
from typing import Literal

__all__ = [
    "CalibrationOptions",
    "CameraPositionPrior",
    "GatingOptions",
    "LocatingOptions",
    "Method",
    "NoiseOptions",
    "PaperOptions",
    "SolvingOptions",
]

Method = Literal["default", "paper"]


@dataclass(frozen=True, slots=True)
class GatingOptions:
    """Which returns can be the reflector."""

    max_speed_mps: float = 0.05
    """Largest absolute Doppler speed of a static return [m/s]; the paper keeps exactly 0."""
    min_range_m: float = 0.5
    """Nearest return kept [m]."""
    max_range_m: float = 60.0
    """Farthest return kept [m]; the paper uses 20."""


@dataclass(frozen=True, slots=True)
class LocatingOptions:
    """How the returns around one click become candidates."""

    window_s: float = 3.0
    """Length of the window centred on the scan nearest to the click [s] (paper: 3 s)."""
    max_candidates: int = 6
    """How many candidates a click keeps."""
    max_time_gap_s: float = 1.5
    """A click farther than this from any scan stays unpaired [s]."""


@dataclass(frozen=True, slots=True)
class NoiseOptions:
    """Standard deviations assumed where the message has none; the solver then estimates by how much they are off."""

    sigma_px: float = 2.0
    """Of a click, per axis [px]."""
    sigma_range_m: float = 0.03
    """Of a placement's range [m]."""
    sigma_azimuth_deg: float = 0.5
    """Of a placement's azimuth [deg]; angle bins and calibration included: scatter in the window understates it."""
    sigma_elevation_deg: float = 1.0
    """Of a placement's elevation [deg]."""
    estimate_scale: bool = True
    """Estimate the noise level from the residuals (variance components) once there are enough pairs."""


@dataclass(frozen=True, slots=True)
class CameraPositionPrior:
    """A tape-measured camera position: the most valuable extra fact there is."""

    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Camera centre in the radar frame: forward, left, up [m]."""
    sigma_m: float = 0.01
    """How well it is known, per axis [m]."""


@dataclass(frozen=True, slots=True)
class SolvingOptions:
    """How pairs become a pose (default method)."""

    camera_position: CameraPositionPrior | None = None
    """Tape-measured camera position, if there is one."""
    nominal_camera_distance_m: float = 1.0
    """Rough distance between the sensors [m]: a wide prior that only tells a pose from its mirror image."""
    seed: int = 1
    """Of every random draw; the same seed gives the same bytes."""


@dataclass(frozen=True, slots=True)
class PaperOptions:
    """What Algorithm 1 of the paper leaves open."""

    z_score_threshold: float = 1.0
    """Largest absolute z-score per axis of a return that is averaged; the authors use 1."""
    z_score_axes: Literal["separately", "in-turn"] = "separately"
    """Each axis judged over the whole window, or as the authors do: y over what x left, z over what y left."""
    window: Literal["centred", "whole-second"] = "centred"
    """Centred on the nearest stamp as the paper prints, or the authors' 1 s to either side of that stamp's whole second."""
    window_s: float = 3.0
    """Length of the centred window [s]."""
    max_range_m: float = 20.0
    """Range filter of Algorithm 1 [m]."""
    max_speed_mps: float = 0.0
    """Velocity filter of Algorithm 1 [m/s]: exactly 0 as printed."""
    ransac_threshold_px: float = 8.0
    """Reprojection error of a RANSAC inlier [px]; the paper gives none, the authors use OpenCV's 8."""
    ransac_iterations: int = 10_000
    """RANSAC iterations; the paper gives none, the authors use 10,000 for the iterative solver."""
    ransac_confidence: float = 0.99
    """RANSAC stops early at this confidence."""


@dataclass(frozen=True, slots=True)
class CalibrationOptions:
    """Everything that steers a calibration."""

    method: Method = "default"
    """The robust estimator, or the paper's Algorithm 1 as printed."""
    gating: GatingOptions = field(default_factory=GatingOptions)
    locating: LocatingOptions = field(default_factory=LocatingOptions)
    noise: NoiseOptions = field(default_factory=NoiseOptions)
    solving: SolvingOptions = field(default_factory=SolvingOptions)
    paper: PaperOptions = field(default_factory=PaperOptions)
