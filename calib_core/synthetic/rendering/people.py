"""The person in the picture: capsules traced analytically, one ray per pixel, with smooth outlines and a soft shadow."""

import numpy as np

from calib_core.arrays import Vector3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.synthetic.rendering.light import display, lit
from calib_core.synthetic.rendering.still import Still
from calib_core.synthetic.scene.person import Capsule, Surface
from calib_core.synthetic.scene.scenes import Scene

_ALBEDO: dict[Surface, tuple[float, float, float]] = {
    "skin": (0.52, 0.33, 0.24),
    "helmet": (0.93, 0.66, 0.04),
    "jacket": (0.055, 0.075, 0.14),
    "vest": (0.95, 0.30, 0.035),
    "yoke": (0.95, 0.30, 0.035),
    "trousers": (0.050, 0.058, 0.085),
    "shoe": (0.035, 0.030, 0.028),
    "stripe": (0.85, 0.85, 0.80),
}
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FAR_PX = 1e6
_PENUMBRA = 0.035
"""How fast a shadow's edge softens with the distance to the object that casts it."""


class Window:
    """A rectangle of the picture, given by its row and column slices."""

    __slots__ = ("columns", "rows")

    def __init__(self, rows: slice, columns: slice) -> None:
        self.rows, self.columns = rows, columns

    @classmethod
    def around(cls, pixels_px: np.ndarray, camera: Camera, margin_px: float = 2.0) -> "Window | None":
        """Return the window around pixels (n, 2); None if it is outside the picture or they are not in front."""
        if not np.all(np.isfinite(pixels_px)):
            return None
        bounded = np.clip(pixels_px, -_FAR_PX, _FAR_PX)  # next to the plane of the lens, pixels are beyond any integer
        low = np.floor(bounded.min(axis=0) - margin_px).astype(int)
        high = np.ceil(bounded.max(axis=0) + margin_px + 1).astype(int)
        low, high = np.maximum(low, 0), np.minimum(high, [camera.width_px, camera.height_px])
        if np.any(high <= low):
            return None
        return cls(slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])))


def _outline(limb: Capsule, inflate_m: float = 0.0) -> np.ndarray:
    """Return points (16, 3) around a limb; their pixels bound it."""
    return np.concatenate(
        [
            limb.start_m + (limb.start_radius_m + inflate_m) * _CORNERS,
            limb.end_m + (limb.end_radius_m + inflate_m) * _CORNERS,
        ]
    )


def _nearest(
    origins: np.ndarray, rays: np.ndarray, limb: Capsule
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Find the closest points of rays and a limb's axis.

    Returns:
        the vector from axis to ray (..., 3), its length, the distance along the ray, and the share along the axis (0 to 1).
    """
    axis = (limb.end_m - limb.start_m).astype(np.float32)
    to_start = limb.start_m.astype(np.float32) - origins
    ray_axis = rays @ axis
    ray_start = rays[..., 0] * to_start[..., 0] + rays[..., 1] * to_start[..., 1] + rays[..., 2] * to_start[..., 2]
    length2 = float(axis @ axis)
    flat = np.maximum(length2 - ray_axis**2, 1e-9)
    share = np.clip((ray_axis * ray_start - to_start @ axis) / flat, 0.0, 1.0)
    along = np.maximum(ray_start + share * ray_axis, 0.0)
    gap = along[..., None] * rays - to_start - share[..., None] * axis
    distance = np.sqrt(gap[..., 0] ** 2 + gap[..., 1] ** 2 + gap[..., 2] ** 2)
    return gap, distance, along, share


def draw_limbs(
    levels: np.ndarray,
    limbs: tuple[Capsule, ...],
    *,
    scene: Scene,
    still: Still,
    camera: Camera,
    camera_from_world: RigidTransform,
    towards: Vector3,
) -> None:
    """Draw limbs into the picture, farthest first, hidden by nearer parts of the backdrop.

    Args:
        levels: (h, w, 3) grey levels, changed in place.
        limbs: in the world.
        scene: for its light.
        still: the backdrop.
        camera: the intrinsics.
        camera_from_world: the camera's pose.
        towards: (3,) direction of the sun.
    """
    pixel_rad = 1.0 / float(camera.matrix_px[0, 0])
    for limb in sorted(limbs, key=lambda one: -float(np.linalg.norm(one.start_m + one.end_m - 2.0 * still.eye_m))):
        window = Window.around(camera.project(camera_from_world @ _outline(limb)), camera)
        if window is None:
            continue
        rays = still.rays[window.rows, window.columns]
        gap, distance, along, share = _nearest(still.eye_m.astype(np.float32), rays, limb)
        radius = limb.start_radius_m + share * (limb.end_radius_m - limb.start_radius_m)
        cover = np.clip((radius - distance) / (along * pixel_rad) + 0.5, 0.0, 1.0)
        cover *= along < still.depth_m[window.rows, window.columns] + 0.05
        if not cover.any():
            continue
        bulge = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))
        normal = (gap - bulge[..., None] * rays) / np.maximum(radius, 1e-4)[..., None]
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
        colour = display(_limb_colour(limb, normal, share, scene, towards))
        patch = levels[window.rows, window.columns]
        patch += (colour - patch) * cover[..., None]


def _limb_colour(limb: Capsule, normal: np.ndarray, share: np.ndarray, scene: Scene, towards: Vector3) -> np.ndarray:
    flat = normal.reshape(-1, 3)
    sun = np.clip(0.12 + 0.88 * (flat @ towards.astype(np.float32)), 0.0, None)  # cloth scatters a little past the edge
    light = lit(scene, flat, sun) * (0.80 + 0.20 * flat[:, 2:3])
    albedo = np.broadcast_to(np.array(_ALBEDO[limb.surface], dtype=np.float32), flat.shape)
    if limb.surface == "vest":
        band = (np.abs(share.ravel() - 0.12) < 0.10) | (np.abs(share.ravel() - 0.72) < 0.10)
        albedo = np.where(band[:, None], np.array(_ALBEDO["stripe"], dtype=np.float32), albedo)
    return (albedo * light).reshape(normal.shape)


def _feet(ends: np.ndarray, towards: Vector3) -> np.ndarray:
    """Project points (n, 3) onto the ground along the light."""
    feet = ends - (np.maximum(ends[:, 2:3], 0.0) / towards[2]) * towards
    feet[:, 2] = 0.0
    return feet


def _near_shadow(points: np.ndarray, limb: Capsule, towards: Vector3) -> np.ndarray:
    """Return the rows of ground points that a limb's shadow, including its soft edge, can reach."""
    feet = _feet(_outline(limb, 0.22), towards)
    low, high = feet.min(axis=0), feet.max(axis=0)
    x, y = points[:, 0], points[:, 1]
    return np.flatnonzero((x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]))


def shade_ground(
    levels: np.ndarray,
    limbs: tuple[Capsule, ...],
    *,
    still: Still,
    camera: Camera,
    camera_from_world: RigidTransform,
    towards: Vector3,
    strength: float = 0.62,
) -> None:
    """Darken the ground, in place, where limbs cast a shadow; the farther they are, the softer it is."""
    if not limbs:
        return
    ends = np.concatenate([_outline(limb, 0.05) for limb in limbs])
    window = Window.around(camera.project(camera_from_world @ _feet(ends, towards)), camera, 6.0)
    if window is None:
        return
    ground = still.ground[window.rows, window.columns]
    rows = np.flatnonzero(ground.ravel())
    rays = still.rays[window.rows, window.columns].reshape(-1, 3)[rows]
    depth = still.depth_m[window.rows, window.columns].ravel()[rows]
    points = (still.eye_m + depth[:, None] * rays).astype(np.float32)
    sun = np.broadcast_to(towards.astype(np.float32), points.shape)
    free = np.ones(len(rows), dtype=np.float32)
    for limb in limbs:
        near = _near_shadow(points, limb, towards)
        _, distance, along, share = _nearest(points[near], sun[near], limb)
        radius = limb.start_radius_m + share * (limb.end_radius_m - limb.start_radius_m)
        soft = 0.012 + _PENUMBRA * along
        free[near] = np.minimum(free[near], np.clip((distance - radius) / (2.0 * soft) + 0.5, 0.0, 1.0))
    dark = np.zeros(ground.size, dtype=np.float32)
    dark[rows] = 1.0 - free
    factor = 1.0 - strength * dark.reshape(ground.shape)
    levels[window.rows, window.columns] *= (factor ** np.float32(1.0 / 2.2))[..., None]
