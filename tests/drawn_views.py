"""Dwell views drawn at random, without images: candidates with known truth, decoys, clutter that repeats itself, people."""

from dataclasses import dataclass, replace

import numpy as np

from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, ReflectorClick, TimeNs
from calib_core.proposing import DwellView, ImageCandidate
from calib_core.radar import cartesian_from_polar, polar_from_cartesian
from calib_core.synthetic.rig import nominal_rotation, typical_camera

START_NS = 1_760_000_000 * NS_PER_S
DWELL_NS = 6 * NS_PER_S
PERIOD_NS = 12 * NS_PER_S


@dataclass(frozen=True, slots=True, eq=False)
class DrawnViews:
    """Views with their truth.

    Attributes:
        views: of all dwells.
        camera: the intrinsics.
        camera_from_radar: the true pose.
        pixels: (n, 2) where the camera sees each reflector; NaN for a dwell that is not the reflector.
    """

    views: tuple[DwellView, ...]
    camera: Camera
    camera_from_radar: RigidTransform
    pixels: np.ndarray

    def click(self, row: int, *, sigma_px: float = 1.0) -> ReflectorClick:
        """Return a true click of a dwell."""
        u_px, v_px = self.pixels[row].tolist()
        return ReflectorClick(self.views[row].image_time, f"click-{row + 1}", u_px, v_px, sigma_px=sigma_px)


@dataclass(frozen=True, slots=True)
class Drawing:
    """How views are drawn.

    Attributes:
        count: of dwells.
        decoys: per dwell, anywhere in the image.
        clutter: decoys per dwell that are at the same places in each.
        first_share: of the dwells whose strongest candidate is the reflector.
        listed_share: of the dwells whose candidates contain it at all.
        persons: dwells that are not the reflector, with a weaker echo.
        offset_m: the camera in the radar frame.
        turned_deg: standard deviation of the mounting's rotation.
        is_flat: the radar measures no elevation.
        noise: factor on the radar's usual errors.
    """

    count: int = 20
    decoys: int = 4
    clutter: int = 1
    first_share: float = 0.9
    listed_share: float = 0.97
    persons: int = 0
    offset_m: tuple[float, float, float] = (0.0, 0.0, 0.05)
    turned_deg: float = 4.0
    is_flat: bool = False
    noise: float = 1.0


def draw_views(seed: int, drawing: Drawing | None = None) -> DrawnViews:
    """Draw the views of one recording."""
    drawing = drawing or Drawing()
    rng = np.random.default_rng(seed)
    camera = typical_camera()
    rotation = rotation_exp(np.deg2rad(drawing.turned_deg) * rng.standard_normal(3)) @ nominal_rotation()
    camera_from_radar = RigidTransform(rotation, -rotation @ np.array(drawing.offset_m))
    points = _points(rng, camera, camera_from_radar, drawing)
    pixels = camera.project(camera_from_radar @ points)
    clutter = rng.uniform([0, 0], [camera.width_px, camera.height_px], (drawing.clutter, 2))
    reported = _reported(rng, points, drawing)
    is_person = np.zeros(drawing.count, dtype=np.bool_)
    is_person[rng.choice(drawing.count, drawing.persons, replace=False)] = True
    views = []
    for i in range(drawing.count):
        candidates = _candidates(rng, camera, None if is_person[i] else pixels[i], clutter, points[i], drawing)
        echo_db = 70.0 - 40.0 * np.log10(np.linalg.norm(points[i])) - (14.0 if is_person[i] else 0.0)
        views.append(_view(i, reported[i], float(echo_db), candidates))
    pixels = np.where(is_person[:, None], np.nan, pixels)
    return DrawnViews(tuple(views), camera, camera_from_radar, pixels)


def with_images_of(radar: DrawnViews, images: DrawnViews) -> tuple[DwellView, ...]:
    """Return the radar's dwells of one recording with the images of another."""
    return tuple(
        replace(view, placement=replace(other.placement, start=view.placement.start, end=view.placement.end))
        for view, other in zip(images.views, radar.views, strict=False)
    )


def _points(
    rng: np.random.Generator, camera: Camera, camera_from_radar: RigidTransform, drawing: Drawing
) -> np.ndarray:
    """Draw positions on the ground, 1.2 m below the radar, that the camera sees."""
    found: list[np.ndarray] = []
    while len(found) < drawing.count:
        range_m, azimuth_rad = rng.uniform(3.0, 14.0), np.deg2rad(rng.uniform(-35.0, 35.0))
        height_m = -1.2 + rng.normal(0.0, 0.05)
        point = np.array([range_m * np.cos(azimuth_rad), range_m * np.sin(azimuth_rad), height_m])
        pixel = camera.project(camera_from_radar @ point[None])[0]
        if (pixel > 20).all() and pixel[0] < camera.width_px - 20 and pixel[1] < camera.height_px - 20:
            found.append(point)
    return np.array(found).reshape(-1, 3)


def _reported(rng: np.random.Generator, points: np.ndarray, drawing: Drawing) -> np.ndarray:
    polar = polar_from_cartesian(points)
    polar += drawing.noise * rng.standard_normal(polar.shape) * [0.03, np.deg2rad(0.4), np.deg2rad(0.8)]
    if drawing.is_flat:
        polar[:, 2] = 0.0
    return cartesian_from_polar(polar)


def _candidates(
    rng: np.random.Generator,
    camera: Camera,
    pixel: np.ndarray | None,
    clutter: np.ndarray,
    point: np.ndarray,
    drawing: Drawing,
) -> tuple[ImageCandidate, ...]:
    size = [camera.width_px, camera.height_px]
    sigma_px = 0.05 * float(camera.matrix_px[0, 0]) / float(np.linalg.norm(point))
    places = [*rng.uniform([0, 0], size, (drawing.decoys, 2)), *(one + rng.normal(0.0, 1.0, 2) for one in clutter)]
    weaker = np.sort(rng.uniform(2.0, 12.0, len(places)))[::-1]
    found = [ImageCandidate(at, sigma_px, strength) for at, strength in zip(places, weaker, strict=True)]
    if pixel is not None and rng.random() < drawing.listed_share:
        strength = rng.uniform(12.0, 20.0) if rng.random() < drawing.first_share else rng.uniform(4.0, 10.0)
        found.append(ImageCandidate(pixel + sigma_px * rng.standard_normal(2), sigma_px, float(strength)))
    return tuple(sorted(found, key=lambda one: -one.strength))


def _view(number: int, position_m: np.ndarray, snr_db: float, candidates: tuple[ImageCandidate, ...]) -> DwellView:
    start = START_NS + number * PERIOD_NS
    middle = TimeNs(start + DWELL_NS // 2)
    placement = Placement(TimeNs(start), TimeNs(start + DWELL_NS), position_m, 0.9, snr_db, fading_db=1.0)
    return DwellView(placement, np.arange(3) + 7 * number, middle, np.zeros((0, 0, 3), np.uint8), 1.0, candidates)
