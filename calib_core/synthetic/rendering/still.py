"""The backdrop without person and reflector, traced once, ray by ray: the scene before a distant sky, skyline and trees."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.surfaces import (
    GROUNDS,
    Patch,
    Solid,
    block,
    display,
    fractal_noise,
    hash_random,
    lit,
    shadowed,
    trace,
    value_noise,
)
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.scenes import Backdrop, Scene

_GRID_PX = 4
_SAMPLES = ((-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25))
_SUN_RADIUS = 0.012
LENS_BLUR_PX = 0.5
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
    sun = scene.towards_sun
    across = np.cross(sun, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across)
    upward = np.cross(across, sun)
    total = np.zeros((rig.camera.height_px, rig.camera.width_px, 3), dtype=np.float32)
    for number, (du, dv) in enumerate(_SAMPLES):
        turn = np.pi / 4.0 + number * np.pi / 2.0
        towards = sun + _SUN_RADIUS * (np.cos(turn) * across + np.sin(turn) * upward)
        rays = pixel_rays(rig, du, dv)
        total += display(_shade(scene, rig, solids, rays, towards / np.linalg.norm(towards)))
    rays = pixel_rays(rig)
    hits = trace(solids, rays.reshape(-1, 3), rig, far_m=_FAR_M[scene.ground], ceiling_m=scene.ceiling_m)
    shape = rays.shape[:2]
    levels = cv2.GaussianBlur(total / np.float32(len(_SAMPLES)), (0, 0), LENS_BLUR_PX)
    return Still(levels, hits.depth_m.reshape(shape), (hits.solid == -1).reshape(shape), rays, eye)


def _shade(scene: Scene, rig: Rig, solids: list[Solid], rays: np.ndarray, towards: Vector3) -> np.ndarray:
    """Return linear colours (h, w, 3) of what the rays hit."""
    flat, eye = rays.reshape(-1, 3), rig.camera_position_world_m.astype(np.float32)
    pixel_rad = 1.0 / float(rig.camera.matrix_px[0, 0])
    hits = trace(solids, flat, rig, far_m=_FAR_M[scene.ground], ceiling_m=scene.ceiling_m)
    colour = np.empty_like(flat)
    away = hits.solid == -3
    colour[away] = _BACKDROPS[scene.backdrop](flat[away].astype(np.float32), pixel_rad)
    for number in np.unique(hits.solid[~away]).tolist():
        rows = np.flatnonzero(hits.solid == number)
        points = eye + hits.depth_m[rows, None] * flat[rows]
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
    return colour.reshape(rays.shape)


def _albedo(
    scene: Scene, solids: list[Solid], number: int, points: np.ndarray, normals: np.ndarray, footprint: np.ndarray
) -> np.ndarray:
    if number == -1:
        return GROUNDS[scene.ground](Patch(points[:, 0], points[:, 1], 1e3, 1e3, footprint, 1))
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


HAZE = np.array([0.66, 0.75, 0.84], dtype=np.float32)
_ZENITH = np.array([0.085, 0.22, 0.60], dtype=np.float32)


def _sky(directions: np.ndarray, footprint_rad: float) -> np.ndarray:
    height = np.clip(directions[:, 2], 0.0, 1.0)
    colour = _ZENITH + (HAZE - _ZENITH) * np.exp(-height / 0.20)[:, None]
    level = 420.0 / (height + 0.12)  # clouds lie on a level sheet, seen at a flatter angle towards the horizon
    u, v = directions[:, 0] * level, directions[:, 1] * level
    footprint = (footprint_rad * level / (height + 0.12)).astype(np.float32)
    billow = fractal_noise(u, v, size_m=620.0, octaves=3, footprint_m=footprint, seed=17, fall=0.5)
    cover = np.clip((billow - 0.12) / 0.75, 0.0, 1.0) * np.clip(height / 0.05, 0.0, 1.0)
    cover = cover * cover * (3.0 - 2.0 * cover) * 0.85
    white = np.array([0.93, 0.94, 0.96], dtype=np.float32)
    return colour + (white - colour) * cover[:, None]


def _skyline(
    azimuth: np.ndarray, elevation: np.ndarray, *, width_rad: float, tallest_rad: float, seed: int, footprint_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return one row of houses: their coverage of each pixel (n,), and their colour before haze (n, 3)."""
    cell = np.floor(azimuth / width_rad).astype(np.int32)
    inside = azimuth / width_rad - cell
    top = tallest_rad * (0.35 + 0.65 * hash_random(cell, cell * 0, seed) ** 1.5)
    set_back = (inside > 0.55) & (hash_random(cell, cell * 0 + 2, seed) > 0.5)
    top = np.where(set_back, top * (0.62 + 0.2 * hash_random(cell, cell * 0 + 3, seed)), top)
    cover = np.clip((top - elevation) / footprint_rad + 0.5, 0.0, 1.0)
    tone = 0.20 + 0.22 * hash_random(cell, cell * 0 + 1, seed)
    warm = hash_random(cell, cell * 0 + 5, seed)[:, None]
    tint = np.array([1.0, 0.92, 0.82]) * warm + np.array([0.82, 0.92, 1.0]) * (1.0 - warm)
    floors = width_rad / 7.0
    pane_u, pane_v = (inside * 9.0) % 1.0, (elevation / floors) % 1.0
    pane = (
        (pane_u > 0.25) & (pane_u < 0.75) & (pane_v > 0.3) & (pane_v < 0.75) & (elevation < top - 0.6 * floors)
    ).astype(np.float32)
    visible = float(np.clip(width_rad / 9.0 / (3.0 * footprint_rad) - 0.9, 0.0, 1.0))
    lit = 1.0 - visible * pane * (0.16 + 0.26 * hash_random(np.floor(inside * 9.0).astype(np.int32), cell, seed))
    side = np.where(inside > 0.72, 0.80, 1.0)
    return cover, (tone * lit * side)[:, None] * tint


def _city(directions: np.ndarray, footprint_rad: float) -> np.ndarray:
    colour = _sky(directions, footprint_rad)
    azimuth = np.arctan2(directions[:, 1], directions[:, 0]) + np.float32(4.0)
    elevation = np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))
    for width_rad, tallest_rad, haze, seed in (
        (0.050, 0.125, 0.80, 3),
        (0.078, 0.095, 0.62, 11),
        (0.118, 0.068, 0.42, 23),
    ):
        cover, house = _skyline(
            azimuth + 0.013 * seed,
            elevation,
            width_rad=width_rad,
            tallest_rad=tallest_rad,
            seed=seed,
            footprint_rad=footprint_rad,
        )
        colour += ((house + (HAZE - house) * haze) - colour) * cover[:, None]
    ground = np.clip(0.5 - elevation / footprint_rad, 0.0, 1.0)[:, None]
    return colour + (0.6 * HAZE - colour) * ground


def _crowns(azimuth: np.ndarray, width_rad: float, seed: int) -> np.ndarray:
    """Return the outline of a row of tree crowns, 0 to 1: round heads of different heights, two rows deep."""
    outline = np.zeros_like(azimuth)
    for shift in (0, 1):
        across = azimuth / width_rad + 0.5 * shift
        cell = np.floor(across).astype(np.int32)
        wide = 0.75 + 0.5 * hash_random(cell, cell * 0 + shift, seed)
        aside = (across - cell - 0.5 + 0.25 * (hash_random(cell, cell * 0 + 2 + shift, seed) - 0.5)) * 2.0 / wide
        tall = 0.55 + 0.45 * hash_random(cell, cell * 0 + 4 + shift, seed)
        outline = np.maximum(outline, tall * np.sqrt(np.maximum(0.0, 1.0 - aside * aside)) ** 0.8)
    return outline


def _trees(directions: np.ndarray, footprint_rad: float) -> np.ndarray:
    colour = _sky(directions, footprint_rad)
    azimuth = np.arctan2(directions[:, 1], directions[:, 0]) + np.float32(4.0)
    elevation = np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))
    flat = np.full_like(azimuth, footprint_rad)
    hills = 0.020 + 0.012 * value_noise(azimuth * 2.3, azimuth * 0.0, 41)
    rows = (
        (hills, 0.0, 0.80, 0.11),
        (np.full_like(azimuth, 0.030), 0.034, 0.36, 0.115),
        (np.full_like(azimuth, 0.014), 0.040, 0.12, 0.095),
    )
    for row, (height, rough, haze, tone) in enumerate(rows):
        twigs = fractal_noise(azimuth, elevation, size_m=0.016, octaves=4, footprint_m=flat, seed=51 + row)
        edge = height + rough * _crowns(azimuth + 0.017 * row, 0.058 - 0.008 * row, 71 + row) + 0.10 * rough * twigs
        cover = np.clip((edge - elevation) / (1.5 * footprint_rad) + 0.5, 0.0, 1.0)
        leaves = fractal_noise(azimuth, elevation, size_m=0.020, octaves=4, footprint_m=flat, seed=61 + row)
        shade = tone * (1.0 + 0.45 * leaves) * (0.45 + 0.75 * np.clip(elevation / np.maximum(edge, 1e-3), 0.0, 1.0))
        tree = np.maximum(shade, 0.01)[:, None] * np.array([0.58, 0.95, 0.38])
        colour += ((tree + (HAZE - tree) * haze * 0.75) - colour) * cover[:, None]
    return colour


def _hall(directions: np.ndarray, footprint_rad: float) -> np.ndarray:
    del footprint_rad
    return np.broadcast_to(np.array([0.30, 0.30, 0.29], dtype=np.float32), directions.shape).copy()


_BACKDROPS: dict[Backdrop, Callable[[np.ndarray, float], np.ndarray]] = {"city": _city, "trees": _trees, "hall": _hall}
"""Colours (n, 3) of the distance, by directions (n, 3) in the world and the size of a pixel [rad]."""
