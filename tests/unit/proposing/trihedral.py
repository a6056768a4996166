"""Images of trihedral corner reflectors, ray by ray, made without the simulator.

Unlike the simulator's: any turn, three shapes of sheets, any three brightnesses, mirror-like streaks, backgrounds of blocks,
lines and texture, lens blur, exposure, gamma, noise and JPEG.
"""

from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

_FINE = 5
_SHAPES = ("triangles", "squares", "quarters")


@dataclass(frozen=True, slots=True, eq=False)
class Appearance:
    """How a reflector is seen.

    Attributes:
        width_px: of its outline, about.
        apex_px: (2,) the true apex.
        reflector_from_camera: (3, 3) its sheets are the planes x = 0, y = 0 and z = 0 of the reflector's axes.
        shape: of the sheets.
        levels: (3,) linear light of the sheets.
        gradients: (3, 2) relative change over a sheet along its two edges.
        blur_px: standard deviation of the lens blur.
        noise_grey: standard deviation of the noise.
        jpeg_quality: None for no compression.
        gain: exposure; above 1 the brightest sheets may saturate.
    """

    width_px: float
    apex_px: np.ndarray
    reflector_from_camera: np.ndarray
    shape: Literal["triangles", "squares", "quarters"]
    levels: np.ndarray
    gradients: np.ndarray
    blur_px: float
    noise_grey: float
    jpeg_quality: int | None
    gain: float


def draw_look(rng: np.random.Generator, *, size_px: tuple[int, int], width_px: float | None = None) -> Appearance:
    """Draw how a reflector may be seen.

    Args:
        rng: the only source of randomness.
        size_px: width and height of the image.
        width_px: of the reflector; None draws 10 to 200 px.
    """
    width = float(np.exp(rng.uniform(np.log(10.0), np.log(200.0)))) if width_px is None else width_px
    levels = rng.permutation([0.15, 0.4, 0.8] * rng.uniform(0.75, 1.25, 3))
    return Appearance(
        width_px=width,
        apex_px=0.5 * np.array(size_px) + rng.uniform(-2.0, 2.0, 2),
        reflector_from_camera=_axes(rng),
        shape=_SHAPES[int(rng.integers(3))],
        levels=levels,
        gradients=rng.uniform(-0.3, 0.3, (3, 2)),
        blur_px=float(rng.uniform(0.3, 1.2)) * (1.0 + width / 150.0),
        noise_grey=float(rng.uniform(0.0, 5.0)),
        jpeg_quality=None if rng.uniform() < 0.2 else int(rng.integers(60, 96)),
        gain=float(rng.uniform(0.5, 1.5)),
    )


def _axes(rng: np.random.Generator) -> np.ndarray:
    """Draw axes whose diagonal is at most 25 deg off the line to the camera, turned by any angle."""
    backwards = np.array([0.0, 0.0, -1.0])
    tilt = np.deg2rad(25.0) * np.sqrt(rng.uniform())
    turn, roll = rng.uniform(0.0, 2.0 * np.pi, 2)
    aside = np.array([np.cos(turn), np.sin(turn), 0.0])
    diagonal = np.cos(tilt) * backwards + np.sin(tilt) * aside
    first = np.cross(diagonal, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(diagonal, first)
    rows = []
    for angle in roll + np.deg2rad([0.0, 120.0, 240.0]):
        rows.append(diagonal / np.sqrt(3.0) + np.sqrt(2.0 / 3.0) * (np.cos(angle) * first + np.sin(angle) * second))
    axes = np.array(rows)
    return axes if np.linalg.det(axes) > 0.0 else axes[[1, 0, 2]]


def noisy_image(look: Appearance, behind: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the image as grey levels (h, w) uint8.

    Args:
        look: how the reflector is seen.
        behind: (h, w) linear light without the reflector.
        rng: of the noise.
    """
    height, width = behind.shape
    reach = int(0.75 * look.width_px + 3)
    x0, y0 = (int(v) for v in np.maximum(np.floor(look.apex_px).astype(int) - reach, 0))
    x1, y1 = min(x0 + 2 * reach + 1, width), min(y0 + 2 * reach + 1, height)
    u, v = (
        (np.arange(n * _FINE) + 0.5) / _FINE - 0.5 + start - look.apex_px[axis]
        for axis, (n, start) in enumerate(((x1 - x0, x0), (y1 - y0, y0)))
    )
    light, hit = _traced(look, *np.meshgrid(u, v))
    fine = np.repeat(np.repeat(behind[y0:y1, x0:x1], _FINE, 0), _FINE, 1)
    fine = np.where(hit, light, fine)
    linear = behind.copy()
    linear[y0:y1, x0:x1] = fine.reshape(y1 - y0, _FINE, x1 - x0, _FINE).mean(axis=(1, 3))
    linear = cv2.GaussianBlur(linear, (0, 0), look.blur_px)
    grey = 255.0 * np.clip(look.gain * linear, 0.0, 1.0) ** (1.0 / 2.2)
    grey = np.clip(grey + look.noise_grey * rng.standard_normal(grey.shape) + 0.5, 0.0, 255.0).astype(np.uint8)
    if look.jpeg_quality is None:
        return grey
    return cv2.imdecode(
        cv2.imencode(".jpg", grey, [cv2.IMWRITE_JPEG_QUALITY, look.jpeg_quality])[1], cv2.IMREAD_GRAYSCALE
    )


def _traced(look: Appearance, u: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the light on the sheets and where they are hit, for pixel offsets from the apex."""
    focal, distance = 1000.0, 1000.0 / look.width_px
    edge = 0.75 if look.shape == "triangles" else 0.62  # the outline is then about one unit wide
    axes = look.reflector_from_camera
    eye = -axes @ np.array([0.0, 0.0, distance])
    rays = np.stack([u / focal, v / focal, np.ones_like(u)], axis=-1) @ axes.T
    nearest = np.full(u.shape, np.inf)
    light = np.zeros(u.shape)
    for sheet in range(3):
        along = -eye[sheet] / rays[..., sheet]
        one, two = ((eye[k] + along * rays[..., k]) / edge for k in range(3) if k != sheet)
        inside = (one >= 0.0) & (two >= 0.0) & (along > 0.0) & (along < nearest)
        outline = {"triangles": one + two, "squares": np.maximum(one, two), "quarters": np.hypot(one, two)}
        inside &= outline[look.shape] <= 1.0
        change = look.gradients[sheet, 0] * one + look.gradients[sheet, 1] * two
        light[inside] = (look.levels[sheet] * (1.0 + change))[inside]
        nearest[inside] = along[inside]
    return light, np.isfinite(nearest)


def background(rng: np.random.Generator, size_px: tuple[int, int]) -> np.ndarray:
    """Draw linear light (h, w) without a reflector: a gradient, texture, blocks with edges and corners, and lines."""
    width, height = size_px
    light = np.full((height, width), rng.uniform(0.05, 0.6))
    light += rng.uniform(-0.1, 0.1) * np.linspace(-1, 1, width)
    for grain in (2, 5, 16, 50):
        rough = rng.standard_normal((height // grain + 2, width // grain + 2))
        light += rng.uniform(0.0, 0.05) * cv2.resize(rough, (width, height), interpolation=cv2.INTER_CUBIC)
    for _ in range(int(rng.integers(0, 8))):
        corners = rng.uniform(0, [width, height], 2) + rng.uniform(4, 60) * rng.standard_normal((4, 2))
        hull = cv2.convexHull(np.round(16 * corners).astype(np.int32))
        cv2.fillConvexPoly(light, hull, float(rng.uniform(0.02, 0.9)), cv2.LINE_AA, 4)
    for _ in range(int(rng.integers(0, 6))):
        ends = rng.uniform(0, [width, height], (2, 2)).astype(int).tolist()
        cv2.line(light, ends[0], ends[1], float(rng.uniform(0.02, 0.9)), int(rng.integers(1, 5)))
    return np.clip(light, 0.01, 1.0)
