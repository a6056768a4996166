"""Poses of a board that a person waves before a camera, or holds badly."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points2, Points3, Vector2
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.intrinsics import Board

_TRIES = 300
_SHIFTS = 12
_RIM_PX = 4.0
_RIM_SQUARES = 1.2
"""Besides the corners, the squares around them are in the picture, and some of the margin."""


@dataclass(frozen=True, slots=True)
class Waving:
    """How a person waves a board.

    Attributes:
        tilt_deg: largest tilt out of the picture's plane.
        roll_deg: largest turn within it.
        size: smallest and largest width of the board, as shares of the picture's width.
        cover: share of the picture, around its middle, in which the board is held.
    """

    tilt_deg: float = 45.0
    roll_deg: float = 25.0
    size: tuple[float, float] = (0.28, 0.65)
    cover: float = 1.0


def waved_poses(
    rng: np.random.Generator, board: Board, camera: Camera, count: int, waving: Waving | None = None
) -> tuple[RigidTransform, ...]:
    """Draw poses at which all squares are in the picture: tilted to all sides, near and far, all over it.

    Args:
        rng: the only source of randomness.
        board: which board.
        camera: that sees it.
        count: number of poses.
        waving: how it is held; None for all over the picture.

    Raises:
        ValueError: the board does not fit in the picture in this way.
    """
    waving = waving or Waving()
    corners = board.corners_m
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    outline = middle + (corners - middle) * (
        1.0 + 2.0 * _RIM_SQUARES * board.square_m / np.append(np.ptp(corners[:, :2], axis=0), 1.0)
    )
    found: list[RigidTransform] = []
    for place in _spread(rng, count):
        drawn = (_drawn(rng, outline, middle, camera, waving, place) for _ in range(_TRIES))
        pose = next((pose for pose in drawn if pose is not None), None)
        if pose is None:
            raise ValueError(f"only {len(found)} of {count} poses of the board fit in the picture")
        found.append(pose)
    return tuple(found)


def _spread(rng: np.random.Generator, count: int) -> Points2:
    """Draw places in the unit square, one per cell of a grid, in random order."""
    side = int(np.ceil(np.sqrt(count)))
    row, column = np.divmod(rng.permutation(side * side)[:count], side)
    return (np.stack([column, row], axis=1) + rng.uniform(size=(count, 2))) / side


def _drawn(
    rng: np.random.Generator, outline: Points3, middle: np.ndarray, camera: Camera, waving: Waving, place: Vector2
) -> RigidTransform | None:
    """Draw a tilt and a size, and shift the board into the region; None if it does not fit there."""
    bearing, tilt = rng.uniform(0.0, 2.0 * np.pi), np.deg2rad(waving.tilt_deg) * np.sqrt(rng.uniform())
    roll = np.deg2rad(waving.roll_deg) * rng.uniform(-1.0, 1.0)
    turned = rotation_exp(tilt * np.array([np.cos(bearing), np.sin(bearing), 0.0])) @ rotation_exp(
        np.array([0.0, 0.0, roll])
    )
    size_px = np.array([camera.width_px, camera.height_px])
    inset = 0.5 * (1.0 - np.sqrt(waving.cover)) * size_px
    low, high = inset + _RIM_PX, size_px - 1 - inset - _RIM_PX
    centre = low + place * (high - low)
    distance = float(np.ptp(outline[:, 0]) * camera.matrix_px[0, 0] / (rng.uniform(*waving.size) * camera.width_px))
    for _ in range(_SHIFTS):
        ray = camera.rays(centre[None])[0]
        if not np.isfinite(ray).all():
            return None
        # the board faces the camera, whatever the ray: tilts are against the line of sight
        rotation = _facing(ray) @ turned
        pose = RigidTransform(rotation, distance * ray - rotation @ middle)
        seen = pose @ outline
        pixels = camera.project(seen)
        if not np.isfinite(pixels).all():
            return None
        beyond = np.maximum(low - pixels.min(axis=0), 0.0) - np.maximum(pixels.max(axis=0) - high, 0.0)
        if not beyond.any():
            return pose if bool(camera.sees(seen).all()) else None
        centre = np.clip(centre + beyond, low, high)
    return None


def _facing(ray: np.ndarray) -> np.ndarray:
    """Return the smallest rotation that turns the optical axis into a ray."""
    axis = np.array([-ray[1], ray[0], 0.0])
    sine = float(np.linalg.norm(axis))
    return np.eye(3) if sine < 1e-9 else rotation_exp(axis / sine * np.arctan2(sine, ray[2]))
