"""Surface colours: linear red, green, blue for each point of a face, with seeded noise and nothing finer than a pixel.

Blocks and pipes are ray traced: what is hit first, and what lies in shadow. Then light and exposure: the sun, the sky, and the
conversion of linear light to grey levels.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.scenes import Box, Ground, Material, Scene


@dataclass(frozen=True, slots=True, eq=False)
class Patch:
    """Points of one face: their position on it, the size of the face, the size of a pixel there.

    Attributes:
        u_m: (n,) across.
        v_m: (n,) up, or away from the camera on level faces.
        width_m: of the face.
        height_m: of the face.
        footprint_m: (n,) size of a pixel.
        seed: which face it is.
    """

    u_m: np.ndarray
    v_m: np.ndarray
    width_m: float
    height_m: float
    footprint_m: np.ndarray
    seed: int

    def noise(self, size_m: float, octaves: int, salt: int = 0, stretch: float = 1.0) -> np.ndarray:
        """Return fractal noise on the face."""
        return fractal_noise(
            self.u_m,
            self.v_m / stretch,
            size_m=size_m,
            octaves=octaves,
            footprint_m=self.footprint_m,
            seed=self.seed * 31 + salt,
        )

    def lines(self, position_m: np.ndarray, period_m: float, width_m: float, blur: float = 1.0) -> np.ndarray:
        """Return the share of each pixel that repeating lines cover, across a position."""
        return line_coverage(position_m, period_m=period_m, width_m=width_m, footprint_m=blur * self.footprint_m)

    def plain(self, *rgb: float) -> np.ndarray:
        """Return one colour for all points: (n, 3)."""
        return np.broadcast_to(np.array(rgb, dtype=np.float32), (len(self.u_m), 3)).copy()

    def border(self, width_m: float) -> np.ndarray:
        """Return 1 within a width of the face's border, else 0."""
        inset = np.minimum(
            np.minimum(self.u_m, self.width_m - self.u_m), np.minimum(self.v_m, self.height_m - self.v_m)
        )
        return np.clip((width_m - inset) / np.maximum(self.footprint_m, 1e-4) + 0.5, 0.0, 1.0)


def _tinted(level: np.ndarray, *rgb: float) -> np.ndarray:
    return np.asarray(level[:, None] * np.array(rgb, dtype=np.float32))


def _mixed(low: np.ndarray, high: np.ndarray | tuple[float, ...], share: np.ndarray) -> np.ndarray:
    return low + (np.asarray(high, dtype=np.float32) - low) * share[:, None]


def _tiles(p: Patch) -> np.ndarray:
    size = 0.6
    tone = cell_random(p.u_m / size + 0.5, p.v_m / size + 0.5, 5)
    warm = cell_random(p.u_m / size + 0.5, p.v_m / size + 0.5, 6)
    joint = np.maximum(p.lines(p.u_m + size / 2, size, 0.012), p.lines(p.v_m + size / 2, size, 0.012, blur=3.0))
    stain = np.clip(p.noise(2.6, 4, 1), -1.0, 1.0)
    level = 0.40 * (1.0 + 0.13 * (tone - 0.5) + 0.10 * stain)
    colour = level[:, None] * (
        np.array([1.0, 0.955, 0.87], dtype=np.float32) + 0.05 * (warm[:, None] - 0.5) * np.array([1.0, 0.0, -1.0])
    )
    return _mixed(colour, (0.13, 0.125, 0.115), 0.85 * joint)


def _grass(p: Patch) -> np.ndarray:
    stripe = np.tanh(9.0 * np.sin(np.pi * p.v_m / 2.4 + 0.6))
    soft = np.clip(1.3 - p.footprint_m * 2.0, 0.0, 1.0)
    patchy = p.noise(3.0, 4, 1)
    blades = p.noise(0.10, 3, 2, stretch=2.0)
    level = 0.17 * (1.0 + 0.07 * stripe * soft + 0.14 * patchy + 0.16 * blades)
    dry = np.clip(0.35 * p.noise(1.4, 3, 3) + 0.12, 0.0, 0.5)
    colour = _mixed(_tinted(level, 0.62, 1.0, 0.30), (0.24, 0.22, 0.10), dry)
    near = p.footprint_m
    line = np.clip((0.06 - np.abs(p.u_m - 19.0)) / near + 0.5, 0.0, 1.0)
    box = (np.abs(p.v_m) < 9.16) * np.clip((0.06 - np.abs(p.u_m - 13.5)) / near + 0.5, 0.0, 1.0)
    side = (p.u_m > 13.44) * (p.u_m < 19.06) * np.clip((0.06 - np.abs(np.abs(p.v_m) - 9.16)) / near + 0.5, 0.0, 1.0)
    chalk = np.maximum(line, np.maximum(box, side)) * (0.85 + 0.15 * np.clip(blades, -1.0, 1.0))
    return _mixed(colour, (0.72, 0.74, 0.70), np.clip(chalk, 0.0, 1.0))


def _floor(p: Patch) -> np.ndarray:
    level = 0.30 * (1.0 + 0.10 * p.noise(1.7, 4, 1) + 0.03 * p.noise(0.06, 2, 2))
    seam = p.lines(p.u_m - 1.0, 4.0, 0.012, blur=4.0)
    colour = _mixed(_tinted(level, 0.98, 0.99, 1.0), (0.10, 0.10, 0.10), seam)
    paint = np.clip((0.05 - np.abs(np.abs(p.v_m) - 1.40)) / p.footprint_m + 0.5, 0.0, 1.0)
    worn = np.clip(0.85 + 0.5 * p.noise(0.25, 3, 3), 0.3, 1.0)
    return _mixed(colour, (0.78, 0.55, 0.05), paint * worn)


def _tar(p: Patch, level: float, stains: float = 0.13, size_m: float = 2.2) -> np.ndarray:
    rough = level * (1.0 + stains * p.noise(size_m, 4, 1) + 0.10 * p.noise(0.05, 2, 2))
    return _tinted(rough, 1.0, 0.99, 0.97)


def _asphalt(p: Patch) -> np.ndarray:
    inside = np.clip((p.u_m - 5.6) / p.footprint_m, 0.0, 1.0)
    bay = p.lines(p.v_m - 1.3, 2.6, 0.11) * inside
    front = np.clip((0.055 - np.abs(p.u_m - 5.6)) / (2.0 * p.footprint_m) + 0.5, 0.0, 1.0)
    worn = np.clip(0.8 + 0.45 * p.noise(0.3, 3, 3), 0.25, 1.0)
    return _mixed(_tar(p, 0.155), (0.66, 0.66, 0.63), np.maximum(bay, front) * worn)


def _yard(p: Patch) -> np.ndarray:
    patched = np.clip(3.0 * p.noise(5.0, 2, 4) - 1.2, 0.0, 0.35)
    return _mixed(_tar(p, 0.17), (0.10, 0.10, 0.10), patched)


def _road(p: Patch) -> np.ndarray:
    across = np.minimum(p.footprint_m, 1.0)
    lanes = np.clip((0.06 - np.abs(np.abs(p.v_m) - 6.1)) / across + 0.5, 0.0, 1.0)
    dashes = np.clip((0.07 - np.abs(p.v_m)) / across + 0.5, 0.0, 1.0) * ((p.u_m % 6.0) < 3.0)
    worn = np.clip(0.85 + 0.4 * p.noise(0.3, 3, 3), 0.3, 1.0)
    colour = _mixed(_tar(p, 0.14, 0.10, 2.6), (0.70, 0.70, 0.67), np.maximum(lanes, dashes) * worn)
    verge = np.clip((np.abs(p.v_m) - 6.6) / across + 0.5, 0.0, 1.0)
    green = 0.16 * (1.0 + 0.2 * p.noise(3.0, 4, 5) + 0.16 * p.noise(0.10, 3, 6))
    return _mixed(colour, _tinted(green, 0.62, 1.0, 0.32), verge)


GROUNDS: dict[Ground, Callable[[Patch], np.ndarray]] = {
    "tiles": _tiles,
    "grass": _grass,
    "floor": _floor,
    "asphalt": _asphalt,
    "yard": _yard,
    "road": _road,
}
"""The ground's colours (n, 3); u_m is x and v_m is y of the world here."""


def _louvre(p: Patch) -> np.ndarray:
    slat = 0.5 + 0.5 * np.cos(2.0 * np.pi * p.v_m / 0.14)
    seen = np.clip(0.14 / (3.0 * p.footprint_m) - 0.5, 0.0, 1.0)
    level = 0.33 + seen * (0.20 * slat - 0.10)
    posts = np.maximum(p.border(0.07), p.lines(p.u_m, 0.8, 0.05))
    return _mixed(_tinted(level, 0.95, 0.98, 1.0), (0.52, 0.53, 0.54), posts)


def _brick(p: Patch) -> np.ndarray:
    row = np.floor(p.v_m / 0.077)
    across = p.u_m / 0.24 + 0.5 * (row % 2)
    tone = cell_random(across, p.v_m / 0.077, p.seed)
    seen = np.clip(0.077 / (1.5 * p.footprint_m) - 0.4, 0.0, 1.0)
    level = 0.26 * (1.0 + 0.40 * (tone - 0.5) * seen + 0.10 * p.noise(1.9, 3, 1))
    joints = np.maximum(p.lines(p.v_m, 0.077, 0.011), p.lines(across * 0.24, 0.24, 0.011))
    return _mixed(_tinted(level, 1.0, 0.56, 0.42), (0.42, 0.39, 0.35), joints)


def _cartons(p: Patch) -> np.ndarray:
    across, up = p.width_m / max(1, round(p.width_m / 0.48)), p.height_m / max(1, round(p.height_m / 0.36))
    tone = cell_random(p.u_m / across, p.v_m / up, p.seed)
    kind = cell_random(p.u_m / across, p.v_m / up, p.seed + 7)
    level = (0.30 + 0.16 * (tone - 0.5)) * (1.0 + 0.05 * p.noise(0.3, 2, 1))
    colour, white = _tinted(level, 1.0, 0.74, 0.47), 0.42 * np.array([0.9, 0.95, 1.0], dtype=np.float32)
    colour = np.where((kind > 0.86)[:, None], white, colour)
    gap = np.maximum(p.lines(p.u_m, across, 0.014), p.lines(p.v_m, up, 0.014))
    tape = p.lines(p.u_m - across / 2, across, 0.05)
    return _mixed(_mixed(colour, (0.46, 0.38, 0.27), 0.6 * tape), (0.05, 0.04, 0.03), gap)


def _checkerboard(p: Patch) -> np.ndarray:
    square = 0.30
    odd = (np.floor(p.u_m / square) + np.floor(p.v_m / square)) % 2
    return _mixed(p.plain(0.70, 0.70, 0.69), (0.025, 0.025, 0.028), odd)


def _render(p: Patch) -> np.ndarray:
    streak = p.noise(0.5, 3, 1, stretch=5.0)
    foot = np.exp(-np.maximum(p.v_m, 0.0) / 0.18)
    level = 0.50 * (1.0 + 0.06 * p.noise(2.0, 3, 2) + 0.05 * streak - 0.20 * foot)
    return _tinted(level, 1.0, 0.955, 0.87)


def _door(p: Patch) -> np.ndarray:
    colour = _mixed(p.plain(0.10, 0.15, 0.19), (0.24, 0.27, 0.29), p.border(0.06))
    handle = (np.abs(p.u_m - 0.12) < 0.05) & (np.abs(p.v_m - 1.02) < 0.025)
    return _mixed(colour, (0.6, 0.6, 0.6), handle.astype(np.float32))


_MATERIALS: dict[Material, Callable[[Patch], np.ndarray]] = {
    "render": _render,
    "metal": lambda p: _tinted(0.44 * (1.0 + 0.05 * p.noise(0.8, 3, 1)), 0.97, 0.99, 1.0),
    "louvre": _louvre,
    "white": lambda p: p.plain(0.72, 0.72, 0.70),
    "dark": lambda p: p.plain(0.09, 0.09, 0.09),
    "wood": lambda p: _tinted(0.27 * (1.0 + 0.16 * p.noise(0.3, 3, 1, stretch=0.12)), 1.0, 0.73, 0.46),
    "cartons": _cartons,
    "brick": _brick,
    "plaster": lambda p: _tinted(0.58 * (1.0 + 0.04 * p.noise(1.5, 3, 1)), 1.0, 0.93, 0.80),
    "checkerboard": _checkerboard,
    "blue": lambda p: p.plain(0.06, 0.17, 0.42),
    "yellow": lambda p: p.plain(0.70, 0.42, 0.04),
    "door": _door,
    "lamp": lambda p: p.plain(6.0, 6.0, 5.8),
}


def hash_random(i: np.ndarray, j: np.ndarray, seed: int) -> np.ndarray:
    """Return a number in 0 to 1 for each pair of integers, the same one every time."""
    with np.errstate(over="ignore"):
        h = i.astype(np.uint32) * np.uint32(0x9E3779B1) ^ j.astype(np.uint32) * np.uint32(0x85EBCA77)
        h = (h ^ np.uint32(seed * 0x27D4EB2F & 0xFFFFFFFF)) * np.uint32(0xC2B2AE3D)
        h = (h ^ (h >> np.uint32(15))) * np.uint32(0x2C1B3C6D)
        h ^= h >> np.uint32(13)
    return (h & np.uint32(0xFFFFFF)).astype(np.float32) / np.float32(0x1000000)


def cell_random(u: np.ndarray, v: np.ndarray, seed: int) -> np.ndarray:
    """Return a number in 0 to 1 that is constant within each unit cell."""
    return hash_random(np.floor(u).astype(np.int32), np.floor(v).astype(np.int32), seed)


def value_noise(u: np.ndarray, v: np.ndarray, seed: int) -> np.ndarray:
    """Return smooth noise in -1 to 1 with features one unit apart."""
    i, j = np.floor(u).astype(np.int32), np.floor(v).astype(np.int32)
    s, t = (u - i).astype(np.float32), (v - j).astype(np.float32)
    s, t = s * s * (3.0 - 2.0 * s), t * t * (3.0 - 2.0 * t)
    low = hash_random(i, j, seed) * (1.0 - s) + hash_random(i + 1, j, seed) * s
    high = hash_random(i, j + 1, seed) * (1.0 - s) + hash_random(i + 1, j + 1, seed) * s
    return 2.0 * (low * (1.0 - t) + high * t) - 1.0


def fractal_noise(
    u_m: np.ndarray,
    v_m: np.ndarray,
    *,
    size_m: float,
    octaves: int,
    footprint_m: np.ndarray,
    seed: int,
    fall: float = 0.6,
) -> np.ndarray:
    """Add octaves of noise, leaving out what is finer than a pixel.

    Args:
        u_m, v_m: where on the surface [m].
        size_m: feature size of the coarsest octave [m].
        octaves: how many, each half the size of the previous one.
        footprint_m: size of a pixel on the surface [m].
        seed: of the pattern.
        fall: amplitude of an octave relative to the previous one.
    """
    total = np.zeros(np.shape(u_m), dtype=np.float32)
    for octave in range(octaves):
        size = size_m / 2.0**octave
        visible = np.clip(size / (2.0 * footprint_m) - 0.5, 0.0, 1.0)
        if float(visible.max(initial=0.0)) <= 0.0:
            break
        total += fall**octave * visible * value_noise(u_m / size, v_m / size, seed + octave)
    return total


def line_coverage(position_m: np.ndarray, *, period_m: float, width_m: float, footprint_m: np.ndarray) -> np.ndarray:
    """Return the share of a pixel covered by repeating lines: 0 to 1, box-filtered.

    Args:
        position_m: across the lines; one is centred on 0 [m].
        period_m: their distance [m].
        width_m: their width [m].
        footprint_m: size of a pixel across them [m].
    """
    half = np.maximum(0.5 * footprint_m, 1e-5)

    def integral(x: np.ndarray) -> np.ndarray:
        whole = np.floor(x / period_m)
        return whole * width_m + np.minimum(x - whole * period_m, width_m)

    shifted = position_m + 0.5 * width_m
    return (integral(shifted + half) - integral(shifted - half)) / (2.0 * half)


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
                colours[rows] = _MATERIALS["metal" if plain_top else self.material](patch)
        return colours


def block(item: Box) -> Solid:
    """Convert an object of a scene to a solid."""
    half = np.array([item.length_m, item.width_m]) / 2.0
    low = np.array([item.x_m - half[0], item.y_m - half[1], item.base_m], dtype=np.float32)
    high = np.array([item.x_m + half[0], item.y_m + half[1], item.base_m + item.height_m], dtype=np.float32)
    return Solid(low, high, item.is_round, item.material)


def trace(solids: list[Solid], rays: np.ndarray, rig: Rig, *, far_m: float, ceiling_m: float) -> Hits:
    """Find what each ray (n, 3) from the camera hits first."""
    origin = rig.camera_position_world_m.astype(np.float32)
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


SUN = np.array([1.34, 1.24, 1.06], dtype=np.float32)
SKY = np.array([0.25, 0.295, 0.365], dtype=np.float32)
_LAMPS = np.array([0.62, 0.61, 0.58], dtype=np.float32)
_BOUNCE = np.array([0.52, 0.51, 0.49], dtype=np.float32)


def lit(scene: Scene, normals: np.ndarray, direct: np.ndarray) -> np.ndarray:
    """Return the light (n, 3) that falls on surfaces.

    Args:
        scene: its light; under a ceiling, lamps and reflections from the walls.
        normals: (n, 3) unit vectors in the world.
        direct: (n,) share of the sun that reaches them, cosine included.
    """
    indoors = scene.ceiling_m > 0.0
    ambient, source = (_BOUNCE, _LAMPS) if indoors else (SKY, SUN)
    up = 0.72 + 0.28 * normals[:, 2]
    return ambient * up[:, None] + source * direct[:, None]


def display(linear: np.ndarray) -> np.ndarray:
    """Convert linear light to grey levels 0 to 255 (float), with a soft shoulder at the bright end."""
    x = np.maximum(linear, 0.0) * np.float32(0.92)
    x = np.where(x > 0.6, 0.6 + 0.4 * np.tanh((x - 0.6) / 0.4), x)
    return np.float32(255.0) * np.power(x, np.float32(1.0 / 2.2))
