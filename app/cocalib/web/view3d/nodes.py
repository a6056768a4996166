"""Nodes of viser that are added once and filled again and again; one without points is hidden, since viser has no empty ones."""

from typing import TYPE_CHECKING, Any

import numpy as np

from calib_core.arrays import Points3

if TYPE_CHECKING:
    import viser

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
