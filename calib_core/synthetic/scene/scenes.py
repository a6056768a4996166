"""What a scene is made of: what the camera sees, what the radar sees, and where the reflector may be put.

World frame: x forward, y left, z up; the radar stands above the origin.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.synthetic.options import SceneName
from calib_core.synthetic.simulated_pairs import PairsLayout

USUAL_EDGE_M = 0.16
"""Length of the three edges that meet at the apex of the usual reflector [m]."""
STANDS_LOWER = 0.32
"""How far below the apex a reflector's lowest corner is, as a share of its edge."""

Material = Literal[
    "render",
    "metal",
    "louvre",
    "white",
    "dark",
    "wood",
    "cartons",
    "brick",
    "plaster",
    "checkerboard",
    "blue",
    "yellow",
    "door",
    "lamp",
]
Ground = Literal["tiles", "grass", "floor", "asphalt", "yard", "road"]
Backdrop = Literal["city", "trees", "hall"]


@dataclass(frozen=True, slots=True)
class Box:
    """An upright block: centre of its base, sizes along x, y, z [m], rotated about z."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    height_m: float
    material: Material
    base_m: float = 0.0
    turn_deg: float = 0.0


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright pipe or post."""

    x_m: float
    y_m: float
    radius_m: float
    height_m: float
    material: Material
    base_m: float = 0.0


@dataclass(frozen=True, slots=True)
class Scatterer:
    """A static object that the radar sees, in the world [m], with its radar cross-section."""

    x_m: float
    y_m: float
    z_m: float
    rcs_dbsm: float


@dataclass(frozen=True, slots=True)
class Board:
    """An upright checkerboard across the x axis: its surface, its lower corner on the right, its squares.

    Attributes:
        x_m, y_m, z_m: the lower corner on the right, as seen from the radar.
        square_m: edge of a square.
        columns, rows: inner corners across and up.
    """

    x_m: float
    y_m: float
    z_m: float
    square_m: float
    columns: int
    rows: int

    @property
    def corners_m(self) -> np.ndarray:
        """The inner corners (columns * rows, 3) in the world, from the lower right one, row by row to the left and up."""
        across, up = np.meshgrid(np.arange(1, self.columns + 1), np.arange(1, self.rows + 1))
        places = [np.full(across.size, self.x_m), self.y_m + self.square_m * across.ravel()]
        return np.stack([*places, self.z_m + self.square_m * up.ravel()], axis=1)

    def hides(self, places_m: np.ndarray) -> np.ndarray:
        """Return which places (n, 3) are behind the board, or next to that, as seen from above the origin."""
        across_m = places_m[:, 1] * self.x_m / np.maximum(places_m[:, 0], 1e-9)
        beside_m = np.maximum(self.y_m - across_m, across_m - self.y_m - self.square_m * (self.columns + 1))
        return np.asarray((places_m[:, 0] > self.x_m - 0.5) & (beside_m < 0.6))


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene.

    Attributes:
        name: its name.
        ground: what the ground looks like.
        backdrop: what is in the distance.
        solids: the objects in it.
        scatterers: what the radar sees of them.
        layout: where the reflector may be put.
        sun_azimuth_deg: direction of the light, as a heading in the world; light from behind the camera lights the facets.
        sun_elevation_deg: elevation of the light.
        ceiling_m: height of a ceiling; 0 for none.
        board: the checkerboard, if there is one with corners to put a reflector at.
    """

    name: SceneName
    ground: Ground
    backdrop: Backdrop
    solids: tuple[Box | Cylinder, ...]
    scatterers: tuple[Scatterer, ...]
    layout: PairsLayout
    sun_azimuth_deg: float = 130.0
    sun_elevation_deg: float = 42.0
    ceiling_m: float = 0.0
    board: Board | None = None

    @property
    def board_corners_m(self) -> np.ndarray:
        """The inner corners of the checkerboard in the world: (n, 3)."""
        return np.zeros((0, 3)) if self.board is None else self.board.corners_m

    @property
    def narrow(self) -> bool:
        """Whether there is no room for a person at the reflector's side."""
        return self.layout.max_lateral_m < 2.0

    def free(self, place_m: np.ndarray, clearance_m: float) -> bool:
        """Return whether a place on the ground (2,) is clear of the solids."""
        for solid in self.solids:
            if solid.base_m > 2.0:
                continue
            half = np.array(
                [solid.radius_m] * 2 if isinstance(solid, Cylinder) else [solid.length_m / 2, solid.width_m / 2]
            )
            outside = np.maximum(np.abs(place_m - [solid.x_m, solid.y_m]) - half, 0.0)
            if float(np.linalg.norm(outside)) < clearance_m:
                return False
        return True
