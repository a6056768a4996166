"""Shapes of the 3D view in the radar frame, as arrays: rings, rays, ellipsoids; and the nodes of viser that they fill."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from calib_core.arrays import Points3
from calib_core.camera import Camera
from calib_core.geometry import OPTICAL_FROM_LINK, RigidTransform
from calib_core.options import NoiseOptions
from calib_core.radar import cartesian_from_polar, covariance_from_sigma_polar
from calib_core.results import Calibration, PairResult
from calib_core.results.calibration import CHI2_95_3
from cocalib.colours import Colour

if TYPE_CHECKING:
    import viser


@dataclass(frozen=True, slots=True)
class Palette:
    """Colours of the 3D view that depend on the background.

    Attributes:
        still: returns that can be the reflector.
        moving: returns that cannot.
        window: static returns around the selected click.
        ray: the selected click's ray.
        next: ring of the best next placement.
        solved: the camera with a calibration.
        rings: of equal range.
        cells: lines of the grid.
    """

    still: Colour
    moving: Colour
    window: Colour
    ray: Colour
    next: Colour
    solved: Colour
    rings: Colour
    cells: Colour


DARK = Palette(
    still=(108, 199, 255), moving=(255, 157, 92), window=(222, 232, 240), ray=(255, 255, 255), next=(185, 227, 255),
    solved=(87, 182, 242), rings=(84, 99, 115), cells=(40, 48, 57),
)  # fmt: skip
LIGHT = Palette(
    still=(20, 120, 190), moving=(205, 85, 15), window=(70, 85, 100), ray=(20, 30, 40), next=(10, 90, 160),
    solved=(10, 111, 179), rings=(140, 152, 165), cells=(221, 226, 232),
)  # fmt: skip
_CIRCLE = 28
_DASH_STEPS = 3


def range_rings(ranges_m: Sequence[float], *, half_angle_rad: float = np.deg2rad(70.0)) -> np.ndarray:
    """Return arcs of equal range around the radar, forward side: segments (n, 2, 3)."""
    azimuths = np.linspace(-half_angle_rad, half_angle_rad, 49)
    arcs = []
    for range_m in ranges_m:
        polar = np.stack([np.full_like(azimuths, range_m), azimuths, np.zeros_like(azimuths)], axis=1)
        arc = cartesian_from_polar(polar)
        arcs.append(np.stack([arc[:-1], arc[1:]], axis=1))
    return np.concatenate(arcs)


def rays_to(calibration: Calibration, pairs: tuple[PairResult, ...]) -> np.ndarray:
    """Return, for each pair, the click's ray from the camera to the depth of the return: segments (n, 2, 3).

    The gap between a ray's end and the return shows the residual in 3D.
    """
    radar_from_camera = calibration.camera_from_radar.inverse()
    pixels = np.array([pair.pixel_px for pair in pairs]).reshape(-1, 2)
    points = calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3))
    distance_m = np.linalg.norm(calibration.camera_from_radar @ points, axis=1)
    ends = radar_from_camera @ (calibration.camera.rays(pixels) * distance_m[:, None])
    starts = np.broadcast_to(radar_from_camera.translation_m, ends.shape)
    segments = np.stack([starts, ends], axis=1)
    return segments[np.all(np.isfinite(segments), axis=(1, 2))]


def ellipsoids(
    points_radar_m: Points3, noise: NoiseOptions, noise_scale: tuple[float, float, float, float]
) -> np.ndarray:
    """Return three great circles of each point's 95 % ellipsoid under the noise model: segments (n, 2, 3).

    Args:
        points_radar_m: (m, 3).
        noise: standard deviations assumed of range, azimuth and elevation.
        noise_scale: estimated divided by assumed standard deviation of (click, range, azimuth, elevation).
    """
    sigma = np.array(
        [noise.sigma_range_m, np.deg2rad(noise.sigma_azimuth_deg), np.deg2rad(noise.sigma_elevation_deg)]
    ) * np.array(noise_scale[1:])
    covariances = covariance_from_sigma_polar(points_radar_m, np.broadcast_to(sigma, points_radar_m.shape))
    squares, axes = np.linalg.eigh(covariances)
    half_axes = axes * np.sqrt(np.maximum(squares, 0.0) * CHI2_95_3)[:, None, :]
    angles = np.linspace(0.0, 2.0 * np.pi, _CIRCLE + 1)
    segments = []
    for first, second in ((0, 1), (0, 2), (1, 2)):
        circle = (
            points_radar_m[:, None, :]
            + np.cos(angles)[None, :, None] * half_axes[:, None, :, first]
            + np.sin(angles)[None, :, None] * half_axes[:, None, :, second]
        )
        segments.append(np.stack([circle[:, :-1], circle[:, 1:]], axis=2).reshape(-1, 2, 3))
    return np.concatenate(segments)


def next_place(places_radar_m: Points3, *, radius_m: float = 0.5, dashes: int = 12) -> np.ndarray:
    """Return a dashed level ring around each place, and a vertical line through it: segments (n, 2, 3).

    Args:
        places_radar_m: (m, 3).
        radius_m: of the ring.
        dashes: of the ring; the gaps are as long.
    """
    starts = 2.0 * np.pi / dashes * np.arange(dashes)
    angles = starts[:, None] + np.linspace(0.0, np.pi / dashes, _DASH_STEPS + 1)
    rim = radius_m * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], axis=-1)
    ring = np.stack([rim[:, :-1], rim[:, 1:]], axis=2).reshape(-1, 2, 3)
    plumb = np.array([[[0.0, 0.0, -radius_m / 2], [0.0, 0.0, radius_m / 2]]])
    shape = np.concatenate([ring, plumb])
    return (places_radar_m[:, None, None, :] + shape).reshape(-1, 2, 3)


def nominal_camera_from_radar() -> RigidTransform:
    """Return the pose of a camera at the radar's position that looks along its x axis, for use without a calibration."""
    return RigidTransform(OPTICAL_FROM_LINK, np.zeros(3))


def vertical_field_of_view_rad(camera: Camera) -> float:
    """Return the angle that the image's height spans, ignoring lens distortion."""
    return 2.0 * float(np.arctan2(camera.height_px / 2.0, camera.matrix_px[1, 1]))


_NOWHERE = np.zeros((1, 3))
_NO_LINE = np.zeros((1, 2, 3))


def add_cloud(scene: "viser.SceneApi", name: str, size_m: float) -> Any:
    """Add a hidden point cloud."""
    return scene.add_point_cloud(
        name, _NOWHERE, (255, 255, 255), point_size=size_m, point_shape="circle", precision="float32", visible=False
    )


def add_lines(scene: "viser.SceneApi", name: str, thickness_px: float, colour: tuple[int, int, int]) -> Any:
    """Add hidden line segments of one colour: viser treats per-point colours as linear light, but takes one colour as it is."""
    return scene.add_line_segments(
        name, _NO_LINE, colour, thickness=thickness_px, thickness_units="screen", visible=False
    )


def fill_cloud(node: Any, points: Points3, colours: np.ndarray) -> None:
    """Assign points (n, 3) and colours (n, 3)."""
    node.visible = len(points) > 0
    if len(points):
        node.points, node.colors = points, colours


def fill_lines(node: Any, segments: np.ndarray) -> None:
    """Assign segments (n, 2, 3)."""
    node.visible = len(segments) > 0
    if len(segments):
        node.points = segments
