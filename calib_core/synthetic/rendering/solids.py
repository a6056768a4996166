"""Ray tracing of blocks and pipes: what is hit first, and what lies in shadow."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rendering.surfaces import Patch, material_colour
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.scenes import Box, Cylinder, Material, Scene

_FAR = np.float32(np.inf)


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """The hits of rays.

    Attributes:
        depth_m: (n,) distance; infinite where nothing is hit.
        solid: (n,) index of the solid; -1 the ground, -2 the ceiling, -3 nothing.
        normal: (n, 3) outward unit vectors.
    """

    depth_m: np.ndarray
    solid: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A block or a pipe in the form used for ray tests."""

    low_m: np.ndarray
    high_m: np.ndarray
    round: bool
    material: Material

    @property
    def base_m(self) -> float:
        """Height of its underside."""
        return float(self.low_m[2])

    @property
    def height_m(self) -> float:
        """Height from underside to top."""
        return float(self.high_m[2] - self.low_m[2])

    def distance(self, places_m: np.ndarray) -> np.ndarray:
        """Return the distance (n,) of places on the ground (n, 2) from it."""
        if self.round:
            middle = 0.5 * (self.low_m[:2] + self.high_m[:2])
            radius = 0.5 * (self.high_m[0] - self.low_m[0])
            return np.maximum(np.hypot(places_m[:, 0] - middle[0], places_m[:, 1] - middle[1]) - radius, 0.0)
        x, y = (
            np.maximum(np.maximum(self.low_m[i] - places_m[:, i], places_m[:, i] - self.high_m[i]), 0.0) for i in (0, 1)
        )
        return np.hypot(x, y)

    def crossing(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distances (n,) at which rays enter (infinite if they miss), and the axis of the face they enter by.

        The axis is 0, 1, 2 for x, y, z; 3 for the side of a pipe.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            first = (self.low_m - origins) / directions
            second = (self.high_m - origins) / directions
        near, far = np.fmin(first, second), np.fmax(first, second)
        axis = np.full(len(directions), 2)
        if self.round:
            side_in, side_out = self._side(origins, directions)
            enter, leave = np.fmax(near[:, 2], side_in), np.fmin(far[:, 2], side_out)
            axis[side_in >= near[:, 2]] = 3
        else:
            enter = np.maximum(np.maximum(near[:, 0], near[:, 1]), near[:, 2])
            leave = np.minimum(np.minimum(far[:, 0], far[:, 1]), far[:, 2])
            axis = np.where(near[:, 0] == enter, 0, np.where(near[:, 1] == enter, 1, 2))
        return np.where((enter <= leave) & (enter > 1e-3), enter, _FAR), axis

    def _side(self, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        middle = 0.5 * (self.low_m[:2] + self.high_m[:2])
        radius = 0.5 * (self.high_m[0] - self.low_m[0])
        offset = origins[..., :2] - middle
        dx, dy = directions[:, 0], directions[:, 1]
        a = np.maximum(dx * dx + dy * dy, 1e-12)
        b = offset[..., 0] * dx + offset[..., 1] * dy
        c = offset[..., 0] ** 2 + offset[..., 1] ** 2 - radius**2
        root = b * b - a * c
        hit = root > 0.0
        reach = np.sqrt(np.where(hit, root, 0.0))
        return np.where(hit, (-b - reach) / a, _FAR), np.where(hit, (-b + reach) / a, -_FAR)

    def normals(self, points: np.ndarray, directions: np.ndarray, axis: np.ndarray) -> np.ndarray:
        """Return outward normals (n, 3) where rays entered by an axis."""
        normals = np.zeros(points.shape, dtype=np.float32)
        flat = axis < 3
        rows = np.flatnonzero(flat)
        normals[rows, axis[rows]] = -np.sign(directions[rows, axis[rows]])
        side = np.flatnonzero(~flat)
        outward = points[side, :2] - 0.5 * (self.low_m[:2] + self.high_m[:2])
        normals[side, :2] = outward / np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
        return normals

    def colour(self, points: np.ndarray, normals: np.ndarray, footprint: np.ndarray) -> np.ndarray:
        """Return the surface's colours (n, 3)."""
        size = self.high_m - self.low_m
        local = points - self.low_m
        across = np.abs(normals)
        along_y = across[:, 0] >= np.maximum(across[:, 1], across[:, 2])
        level = across[:, 2] > 0.7
        colours = np.empty(points.shape, dtype=np.float32)
        faces = ((along_y & ~level, 1, 2), (~along_y & ~level, 0, 2), (level, 0, 1))
        for seed, (rows, u, v) in enumerate(faces):
            if rows.any():
                shift = int(abs(self.low_m[0]) * 13 + abs(self.low_m[1]) * 7 + self.low_m[2] * 5)
                patch = Patch(
                    local[rows, u], local[rows, v], float(size[u]), float(size[v]), footprint[rows], 3 + seed + shift
                )
                plain_top = seed == 2 and self.material in ("louvre", "door", "checkerboard")
                colours[rows] = material_colour("metal" if plain_top else self.material, patch)
        return colours


def block(item: Box | Cylinder) -> Solid:
    """Convert an object of a scene to a solid."""
    half = (
        np.array([item.radius_m, item.radius_m])
        if isinstance(item, Cylinder)
        else np.array([item.length_m, item.width_m]) / 2.0
    )
    low = np.array([item.x_m - half[0], item.y_m - half[1], item.base_m], dtype=np.float32)
    high = np.array([item.x_m + half[0], item.y_m + half[1], item.base_m + item.height_m], dtype=np.float32)
    return Solid(low, high, isinstance(item, Cylinder), item.material)


def trace(solids: list[Solid], eye: Vector3, rays: np.ndarray, rig: Rig, *, far_m: float, ceiling_m: float) -> Hits:
    """Find what each ray (n, 3) from the eye hits first."""
    origin = eye.astype(np.float32)
    depth = np.full(len(rays), _FAR, dtype=np.float32)
    index = np.full(len(rays), -3, dtype=np.int32)
    normal = np.zeros((len(rays), 3), dtype=np.float32)
    for level, number, up in ((0.0, -1, 1.0), (ceiling_m, -2, -1.0)):
        if number == -2 and ceiling_m <= 0.0:
            continue
        with np.errstate(divide="ignore"):
            reach = (level - origin[2]) / rays[:, 2]
        good = (reach > 0.0) & (np.abs(reach) < 1e6)
        good[good] = (origin[0] + reach[good] * rays[good, 0]) < far_m
        depth[good], index[good] = reach[good], number
        normal[good] = (0.0, 0.0, up)
    for number, solid in enumerate(solids):
        rows = _rows_near(solid, rig)
        if len(rows) == 0:
            continue
        reach, axis = solid.crossing(origin, rays[rows])
        closer = reach < depth[rows]
        chosen = rows[closer]
        depth[chosen], index[chosen] = reach[closer], number
        points = origin + reach[closer, None] * rays[chosen]
        normal[chosen] = solid.normals(points, rays[chosen], axis[closer])
    return Hits(depth, index, normal)


def _rows_near(solid: Solid, rig: Rig) -> np.ndarray:
    """Return the flat indices of the pixels in a solid's image rectangle; all of them if part of it is far off the axis."""
    camera = rig.camera
    steps = np.linspace(0.0, 1.0, 5)
    corners = np.array([[x, y, z] for x in steps for y in steps for z in steps])
    points = rig.camera_from_world @ (solid.low_m + corners * (solid.high_m - solid.low_m)).astype(np.float64)
    everything = np.arange(camera.width_px * camera.height_px)
    angle = np.arctan2(np.linalg.norm(points[:, :2], axis=1), points[:, 2])
    if np.any(angle > np.deg2rad(50.0)):
        return everything
    pixels = camera.project(points)
    low = np.floor(pixels.min(axis=0) - 4).astype(int)
    high = np.ceil(pixels.max(axis=0) + 5).astype(int)
    u = np.arange(max(low[0], 0), min(high[0], camera.width_px))
    v = np.arange(max(low[1], 0), min(high[1], camera.height_px))
    return (v[:, None] * camera.width_px + u[None]).ravel()


def shadowed(
    scene: Scene, solids: list[Solid], points: np.ndarray, normals: np.ndarray, towards: Vector3
) -> np.ndarray:
    """Return 1 where a solid stands between points (n, 3) and the sun, else 0; indoors, lamps cast no hard shadow."""
    dark = np.zeros(len(points), dtype=np.float32)
    if scene.ceiling_m > 0.0 or len(points) == 0:
        return dark
    start = points + 2e-3 * normals
    direction = towards.astype(np.float32)
    for solid in solids:
        rise = (solid.high_m[2] - start[:, 2]) / direction[2]
        low = np.minimum(solid.low_m[:2], solid.low_m[:2] - direction[:2] * max(float(rise.max()), 0.0))
        high = np.maximum(solid.high_m[:2], solid.high_m[:2] - direction[:2] * max(float(rise.max()), 0.0))
        x, y = start[:, 0], start[:, 1]
        near = np.flatnonzero((rise > 0.0) & (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]))
        if len(near):
            reach, _ = solid.crossing(start[near], np.broadcast_to(direction, (len(near), 3)))
            dark[near[np.isfinite(reach)]] = 1.0
    return dark
