"""One simulated session of a vehicle: how the camera is mounted, what the sensors get wrong, and the recording of both."""

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Vector3, frozen_array
from calib_core.geometry import rotation_exp, rotation_log
from calib_core.options import LensOptions, RadarOptions, ReflectorOptions
from calib_core.synthetic import Clicking, IntrinsicsErrors, RadarDefects, SimulationOptions
from calib_core.synthetic.rig import RigOptions

__all__ = ["RECORDING", "Fault", "Mounting", "VehicleErrors", "recording_of"]

Fault: TypeAlias = Literal["mirrored radar", "radar of another type", "broken recording", "no clicks"]

_START_S, _MONTH_S = 1_760_000_000, 30 * 86_400
RECORDING = SimulationOptions(
    scene="field",
    radar="imaging",
    placements=24,
    dwell_s=3.5,
    heights=True,
    person=False,
    width_px=640,
    height_px=400,
    camera_rate_hz=1.0,
    radar_rate_hz=4.0,
    click_sigma_px=0.5,
)
"""What all recordings have in common: short, with small pictures, the reflector on a tripod, nobody in sight."""


@dataclass(frozen=True, slots=True, eq=False)
class Mounting:
    """How a camera is mounted.

    Attributes:
        angles_deg: (3,) its rotation away from looking where the radar looks, in the camera frame [deg].
        position_m: (3,) of its centre in the radar frame [m].
    """

    angles_deg: Vector3
    position_m: Vector3

    def __post_init__(self) -> None:
        for name in ("angles_deg", "position_m"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (3,)))

    def moved(self, angles_deg: Vector3, position_m: Vector3) -> "Mounting":
        """Turn the camera by a rotation vector in its own frame and move it."""
        turned = rotation_exp(np.deg2rad(angles_deg)) @ rotation_exp(np.deg2rad(self.angles_deg))
        return Mounting(np.rad2deg(rotation_log(turned)), self.position_m + position_m)


@dataclass(frozen=True, slots=True)
class VehicleErrors:
    """What a vehicle's sensors get wrong in all of its sessions."""

    radar: RadarDefects
    intrinsics: IntrinsicsErrors

    @classmethod
    def drawn(cls, rng: np.random.Generator, *, width_px: int) -> "VehicleErrors":
        """Draw errors with the standard deviations that the solver assumes of a radar and of a lens.

        Args:
            rng: the only source of randomness.
            width_px: of the pictures.
        """
        radar, lens = RadarOptions(), LensOptions()
        azimuth, elevation, bias, scale, focal, right, down = rng.standard_normal(7).tolist()
        point_px = lens.principal_point_sigma_px * width_px / 1920.0
        return cls(
            RadarDefects(
                azimuth_scale=1.0 + radar.azimuth_scale_sigma * azimuth,
                elevation_scale=1.0 + radar.elevation_scale_sigma * elevation,
                range_bias_m=radar.range_bias_sigma_m * bias,
                range_scale=1.0 + radar.range_scale_sigma * scale,
            ),
            IntrinsicsErrors(
                focal_length_scale=1.0 + lens.focal_length_sigma * focal,
                principal_point_px=(point_px * right, point_px * down),
            ),
        )


def recording_of(
    mounting: Mounting,
    errors: VehicleErrors,
    recording: SimulationOptions,
    rng: np.random.Generator,
    *,
    index: int = 0,
    fault: Fault | None = None,
) -> SimulationOptions:
    """Return the options of one session's recording.

    Whoever clicks is off by the same pixels in all of it, as much as the solver assumes; the next session is somebody else's.

    Args:
        mounting: of the camera.
        errors: of the vehicle's sensors.
        recording: what all recordings have in common.
        rng: the only source of randomness.
        index: of the session.
        fault: what is wrong; None if nothing is.
    """
    radar = errors.radar
    if fault == "mirrored radar":
        radar = replace(radar, mirrored=True)
    if fault == "radar of another type":
        radar = replace(radar, azimuth_scale=1.35, elevation_scale=0.7)
    x, y, z = mounting.position_m.tolist()
    roll, pitch, yaw = mounting.angles_deg.tolist()
    rig = RigOptions(
        camera_offset_m=(x, y, z),
        camera_offset_sigma_m=0.0,
        camera_angles_deg=(roll, pitch, yaw),
        camera_angle_sigma_deg=0.0,
    )
    low_px = ReflectorOptions().click_offset_sigma_px * float(rng.standard_normal())
    return replace(
        recording,
        rig=rig,
        defects=radar,
        intrinsics=errors.intrinsics,
        clicking=Clicking(low_px=low_px),
        seed=int(rng.integers(2**31)),
        start_s=_START_S + index * _MONTH_S,
    )
