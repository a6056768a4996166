"""The backdrop without person and reflector: traced once, ray by ray through the lens model."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.horizon import HAZE, backdrop_colour
from calib_core.synthetic.rendering.light import display, lit, sun_direction
from calib_core.synthetic.rendering.solids import Hits, Solid, block, shadowed, trace
from calib_core.synthetic.rendering.surfaces import Patch, ground_colour
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.scenes import Scene

_GRID_PX = 4
_SAMPLES = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))
_SUN_RADIUS = 0.012
_LENS_BLUR_PX = 0.5
"""Standard deviation of the lens blur of the backdrop."""
_FAR_M = {"tiles": 22.3, "grass": 400.0, "floor": 22.0, "asphalt": 12.0, "yard": 400.0, "road": 400.0}


@dataclass(frozen=True, slots=True, eq=False)
class Still:
    """The backdrop, with the data needed to draw moving objects in front of it.

    Attributes:
        levels: (h, w, 3) float32 grey levels, red first.
        depth_m: (h, w) distance of what each pixel sees; infinite for the sky.
        ground: (h, w) pixels that see the ground.
        rays: (h, w, 3) unit directions in the world.
        eye_m: (3,) the camera centre in the world.
    """

    levels: np.ndarray
    depth_m: np.ndarray
    ground: np.ndarray
    rays: np.ndarray
    eye_m: Vector3


def pixel_rays(rig: Rig, du_px: float = 0.0, dv_px: float = 0.0) -> np.ndarray:
    """Return the rays of the pixels: (h, w, 3) unit directions in the world, exact on a 4 px grid, interpolated in between."""
    camera = rig.camera
    columns, rows = camera.width_px // _GRID_PX + 3, camera.height_px // _GRID_PX + 3
    u, v = np.meshgrid(np.arange(columns) * _GRID_PX + du_px, np.arange(rows) * _GRID_PX + dv_px)
    exact = camera.rays(np.stack([u.ravel(), v.ravel()], axis=1)) @ rig.camera_from_world.rotation
    grid = exact.reshape(rows, columns, 3).astype(np.float32)
    x, y = np.meshgrid(np.arange(camera.width_px) / _GRID_PX, np.arange(camera.height_px) / _GRID_PX)
    i, j = x.astype(np.int32), y.astype(np.int32)
    s, t = (x - i).astype(np.float32)[..., None], (y - j).astype(np.float32)[..., None]
    rays = (grid[j, i] * (1 - s) + grid[j, i + 1] * s) * (1 - t) + (
        grid[j + 1, i] * (1 - s) + grid[j + 1, i + 1] * s
    ) * t
    rays = np.nan_to_num(rays.reshape(-1, 3))  # a lens may see nothing at all in its corners
    return (rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1e-6)).reshape(*x.shape, 3)


def trace_still(scene: Scene, rig: Rig) -> Still:
    """Trace a scene's backdrop, four samples per pixel, each with the sun at another point of its disc."""
    import cv2

    eye = rig.camera_position_world_m
    solids = [block(item) for item in scene.solids]
    sun = sun_direction(scene)
    across = np.cross(sun, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    upward = np.cross(across, sun)
    total = np.zeros((rig.camera.height_px, rig.camera.width_px, 3), dtype=np.float32)
    for number, (du, dv) in enumerate(_SAMPLES):
        turn = np.pi / 4.0 + number * np.pi / 2.0
        towards = sun + _SUN_RADIUS * (np.cos(turn) * across + np.sin(turn) * upward)
        rays = pixel_rays(rig, du, dv)
        colour, _ = _shade(scene, rig, solids, eye, rays, towards / np.linalg.norm(towards))
        total += display(colour)
    rays = pixel_rays(rig)
    hits = trace(solids, eye, rays.reshape(-1, 3), rig, far_m=_FAR_M[scene.ground], ceiling_m=scene.ceiling_m)
    shape = rays.shape[:2]
    levels = cv2.GaussianBlur(total / np.float32(len(_SAMPLES)), (0, 0), _LENS_BLUR_PX)
    return Still(levels, hits.depth_m.reshape(shape), (hits.solid == -1).reshape(shape), rays, eye)


def _shade(
    scene: Scene, rig: Rig, solids: list[Solid], eye: Vector3, rays: np.ndarray, towards: Vector3
) -> tuple[np.ndarray, Hits]:
    """Return linear colours (h, w, 3) of what the rays hit."""
    flat = rays.reshape(-1, 3)
    pixel_rad = 1.0 / float(rig.camera.matrix_px[0, 0])
    hits = trace(solids, eye, flat, rig, far_m=_FAR_M[scene.ground], ceiling_m=scene.ceiling_m)
    colour = np.empty_like(flat)
    away = hits.solid == -3
    colour[away] = backdrop_colour(scene.backdrop, flat[away], pixel_rad)
    for number in np.unique(hits.solid[~away]).tolist():
        rows = np.flatnonzero(hits.solid == number)
        points = eye.astype(np.float32) + hits.depth_m[rows, None] * flat[rows]
        normals = hits.normal[rows]
        slant = np.maximum(np.abs(np.sum(normals * flat[rows], axis=1)), 0.06)
        footprint = (hits.depth_m[rows] * pixel_rad / np.sqrt(slant)).astype(np.float32)
        albedo = _albedo(scene, solids, number, points, normals, footprint)
        direct = np.maximum(normals @ towards.astype(np.float32), 0.0)
        facing = direct > 0.0
        direct[facing] *= 1.0 - shadowed(scene, solids, points[facing], normals[facing], towards)
        light = lit(scene, normals, direct) * _openness(scene, solids, number, points)[:, None]
        haze = 1.0 - np.exp(-hits.depth_m[rows] / (900.0 if scene.ceiling_m == 0.0 else 1e9))
        shaded = albedo * light
        colour[rows] = shaded + (HAZE - shaded) * haze[:, None]
    return colour.reshape(rays.shape), hits


def _albedo(
    scene: Scene, solids: list[Solid], number: int, points: np.ndarray, normals: np.ndarray, footprint: np.ndarray
) -> np.ndarray:
    if number == -1:
        return ground_colour(scene.ground, Patch(points[:, 0], points[:, 1], 1e3, 1e3, footprint, 1))
    if number == -2:
        return np.broadcast_to(np.array([0.62, 0.62, 0.60], dtype=np.float32), points.shape).copy()
    return solids[number].colour(points, normals, footprint)


def _openness(scene: Scene, solids: list[Solid], number: int, points: np.ndarray) -> np.ndarray:
    """Darken the ground around objects, and the foot of objects: ambient occlusion under a wide sky."""
    if number >= 0:
        return 1.0 - 0.30 * np.exp(-np.maximum(points[:, 2], 0.0) / 0.22)
    open_share = np.ones(len(points), dtype=np.float32)
    if number == -2:
        return open_share
    for solid in solids:
        if solid.base_m > 0.6:
            continue
        gap = solid.distance(points[:, :2])
        reach = min(0.45, 0.35 * solid.height_m + 0.05)
        open_share *= 1.0 - 0.42 * np.exp(-gap / reach)
    return open_share
