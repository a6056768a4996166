"""The sensor mast: a camera mounted next to a radar, and the pose of both in the world.

World frame: x forward along the ground, y left, z up; the origin on the ground below the radar.
"""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Matrix33, Points2, Vector3
from calib_core.camera import Camera, CameraModel
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.lens_models.registry import LENS_MODELS
from calib_core.options import option

NOMINAL_ROTATION = ((0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0))
"""Optical axes (right, down, forward) in radar axes (forward, left, up): a camera that looks in the radar's direction."""

_OFFSET_SIGMA_M = 0.01
"""Standard deviation of a true camera centre about the nominal one, per axis."""
OTHER_OFFSET_M, OTHER_YAW_DEG = (-0.4, 0.9, 0.25), -5.0
"""Nominal centre of a second camera in the radar frame, and how far to the left it looks of where the radar looks."""


@dataclass(frozen=True, slots=True)
class RigOptions:
    """How the sensors are mounted; the true values are random around these."""

    radar_height_m: float = option(1.2, "Height of the radar above the ground [m].", low=0.05, high=20.0)
    radar_tilt_deg: float = option(10.0, "How far the radar looks down [deg].", low=-90.0, high=90.0)
    radar_roll_deg: float = option(0.0, "How far the radar leans to its right [deg].", low=-180.0, high=180.0)
    camera_offset_m: tuple[float, float, float] = option(
        (0.0, 0.0, 0.045), "Nominal camera centre in the radar frame: forward, left, up [m].", low=-20.0, high=20.0
    )
    camera_angles_deg: tuple[float, float, float] = option(
        (0.0, 0.0, 0.0),
        "Nominal rotation of the camera away from looking where the radar looks: its rotation vector in the camera frame [deg].",
        low=-180.0,
        high=180.0,
    )
    camera_angle_sigma_deg: float = option(
        3.0, "Standard deviation of the true rotation about the nominal one, per axis [deg].", low=0.0, high=90.0
    )


@dataclass(frozen=True, slots=True, eq=False)
class Rig:
    """Two sensors with known truth.

    Attributes:
        camera: the intrinsics.
        camera_from_radar: the true pose that a calibration estimates.
        radar_from_world: the pose of the mast.
    """

    camera: Camera
    camera_from_radar: RigidTransform
    radar_from_world: RigidTransform

    @property
    def camera_from_world(self) -> RigidTransform:
        """The camera's pose in the world."""
        return self.camera_from_radar @ self.radar_from_world

    @property
    def camera_position_radar_m(self) -> Vector3:
        """The camera centre in the radar frame: (3,) [m]; what a tape measure would give."""
        return self.camera_from_radar.inverse().translation_m

    @property
    def camera_position_world_m(self) -> Vector3:
        """The camera centre in the world: (3,) [m]."""
        return self.camera_from_world.inverse().translation_m


def nominal_rotation() -> Matrix33:
    """Return NOMINAL_ROTATION as a matrix."""
    return np.array(NOMINAL_ROTATION)


def typical_camera(
    model: CameraModel = "plumb_bob",
    *,
    width_px: int = 1280,
    height_px: int = 720,
    field_of_view_deg: float | None = None,
) -> Camera:
    """Make a plausible camera with a lens model.

    Args:
        model: the lens model; each has visible distortion.
        width_px: columns.
        height_px: rows.
        field_of_view_deg: horizontal field of view before distortion [deg]; None takes the lens model's typical one.
    """
    typical = LENS_MODELS[model].typical
    half_rad = np.deg2rad(field_of_view_deg or typical.field_of_view_deg) / 2.0
    focal_px = (width_px / 2.0) / typical.radius_at(half_rad)
    matrix = np.array(
        [
            [focal_px, 0.0, (width_px - 1) / 2.0 + 0.006 * width_px],
            [0.0, focal_px * 1.0008, (height_px - 1) / 2.0 - 0.004 * height_px],
            [0.0, 0.0, 1.0],
        ]
    )
    return Camera(model, width_px, height_px, matrix, np.array(typical.distortion))


def radar_stand(options: RigOptions) -> RigidTransform:
    """Return radar_from_world of a radar at the given height, tilted down and leaning."""
    tilt = rotation_exp(np.array([0.0, np.deg2rad(options.radar_tilt_deg), 0.0]))  # world_from_radar: nose down
    if options.radar_roll_deg:
        tilt = tilt @ rotation_exp(np.array([np.deg2rad(options.radar_roll_deg), 0.0, 0.0]))
    world_from_radar = RigidTransform(tilt, np.array([0.0, 0.0, options.radar_height_m]))
    return world_from_radar.inverse()


def random_rig(rng: np.random.Generator, *, camera: Camera, options: RigOptions | None = None) -> Rig:
    """Draw the true pose of the camera.

    Args:
        rng: the only source of randomness.
        camera: the intrinsics.
        options: how the sensors are mounted; None takes the defaults.
    """
    options = options or RigOptions()
    error_rad = np.deg2rad(options.camera_angle_sigma_deg) * rng.standard_normal(3)
    rotation = rotation_exp(error_rad) @ rotation_exp(np.deg2rad(options.camera_angles_deg)) @ nominal_rotation()
    centre = np.array(options.camera_offset_m) + _OFFSET_SIGMA_M * rng.standard_normal(3)
    return Rig(camera, RigidTransform(rotation, -rotation @ centre), radar_stand(options))


_FAR_PX = 1e6


@dataclass(frozen=True, slots=True)
class Window:
    """A rectangle of the image, given by its row and column slices."""

    rows: slice
    columns: slice

    @classmethod
    def around(cls, pixels_px: Points2, camera: Camera, margin_px: float = 2.0) -> "Window | None":
        """Return the window around pixels (n, 2); None if it is outside the image or they are not in front."""
        if not np.all(np.isfinite(pixels_px)):
            return None
        bounded = np.clip(pixels_px, -_FAR_PX, _FAR_PX)  # next to the plane of the lens, pixels are beyond any integer
        low = np.floor(bounded.min(axis=0) - margin_px).astype(int)
        high = np.ceil(bounded.max(axis=0) + margin_px + 1).astype(int)
        low, high = np.maximum(low, 0), np.minimum(high, [camera.width_px, camera.height_px])
        if np.any(high <= low):
            return None
        return cls(slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])))
