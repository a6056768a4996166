"""What a scene is made of: what the camera sees, what the radar sees, and where the reflector may be put.

The scenes by name: open ones, with nothing that echoes within 20 m, and those with walls and shelves near the placements.
World frame: x forward, y left, z up; the radar stands above the origin.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.options import SceneName

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
    """An upright block, or a round one: centre of its base, sizes along x, y, z [m]."""

    x_m: float
    y_m: float
    length_m: float
    width_m: float
    height_m: float
    material: Material
    base_m: float = 0.0
    is_round: bool = False


def post(x_m: float, y_m: float, radius_m: float, height_m: float, material: Material, base_m: float = 0.0) -> Box:
    """Return an upright pipe or post."""
    return Box(x_m, y_m, 2.0 * radius_m, 2.0 * radius_m, height_m, material, base_m, is_round=True)


@dataclass(frozen=True, slots=True)
class Scatterer:
    """A static object that the radar sees, in the world [m], with its radar cross-section."""

    position_m: tuple[float, float, float]
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
class PairsLayout:
    """Where the reflector is put, in the world."""

    min_range_m: float = 2.0
    """Nearest placement [m]."""
    max_range_m: float = 20.0
    """Farthest placement [m]."""
    max_azimuth_deg: float = 35.0
    """Largest bearing to either side [deg]."""
    max_lateral_m: float = 100.0
    """Largest distance from the radar's axis [m]; an aisle is narrow."""
    height_m: float = 0.025
    """Height of the reflector's phase centre above the ground [m]."""
    roughness_m: float = 0.01
    """Standard deviation of the ground's height [m]."""
    max_height_m: float = 0.0
    """If above 0, heights are uniform from height_m up to this, as on a tripod [m]."""
    separation_m: float = 0.35
    """Smallest distance between two placements [m]."""


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
    solids: tuple[Box, ...]
    scatterers: tuple[Scatterer, ...]
    layout: PairsLayout
    sun_azimuth_deg: float = 130.0
    sun_elevation_deg: float = 42.0
    ceiling_m: float = 0.0
    board: Board | None = None

    @property
    def towards_sun(self) -> Vector3:
        """The direction towards the light: (3,) in the world."""
        azimuth, elevation = np.deg2rad(self.sun_azimuth_deg), np.deg2rad(self.sun_elevation_deg)
        return np.array([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])

    @property
    def narrow(self) -> bool:
        """Whether there is no room for a person at the reflector's side."""
        return self.layout.max_lateral_m < 2.0

    def free(self, place_m: np.ndarray, clearance_m: float) -> bool:
        """Return whether a place on the ground (2,) is clear of the solids."""
        for solid in self.solids:
            if solid.base_m > 2.0:
                continue
            half = np.array([solid.length_m / 2, solid.width_m / 2])
            outside = np.maximum(np.abs(place_m - [solid.x_m, solid.y_m]) - half, 0.0)
            if float(np.linalg.norm(outside)) < clearance_m:
                return False
        return True


_ROOFTOP = PairsLayout(2.3, 16.5, 31.0, height_m=0.19, roughness_m=0.004, separation_m=0.9)
_YARD = PairsLayout(2.3, 16.5, 31.0, height_m=0.19, roughness_m=0.004, separation_m=0.6)


def open_rooftop() -> Scene:
    """Build a rooftop with nothing that echoes within 20 m."""
    parapets = (
        Box(22.3, 0.0, 0.35, 60.0, 1.05, "render"),
        Box(22.3, 0.0, 0.5, 60.0, 0.07, "metal", base_m=1.05),
    )
    units = (
        Box(21.0, 7.4, 1.7, 2.4, 1.5, "louvre", base_m=0.15),
        Box(21.0, 7.4, 1.4, 2.0, 0.15, "dark"),
        post(21.4, -6.2, 0.14, 1.2, "metal"),
    )
    scatterers = (
        Scatterer((20.2, 6.3, 0.8), 6.0),
        Scatterer((21.3, -6.2, 0.7), 2.0),
        Scatterer((22.1, -0.4, 0.6), 12.0),
        Scatterer((22.1, 4.9, 0.5), 5.0),
        Scatterer((22.1, -9.2, 0.5), 5.0),
    )
    return Scene("open-rooftop", "tiles", "city", (*parapets, *units), scatterers, _ROOFTOP)


def open_yard() -> Scene:
    """Build a yard with a checkerboard of plastic foam on a stand and a wall at 26 m."""
    wall = (
        Box(26.0, 0.0, 0.4, 70.0, 4.4, "brick"),
        Box(25.74, -6.9, 0.08, 1.0, 2.1, "door"),
    )
    board = (
        Box(6.56, 2.25, 0.06, 2.9, 2.0, "white", base_m=0.25),
        Box(6.52, 2.25, 0.02, 2.7, 1.8, "checkerboard", base_m=0.35),
        post(6.7, 3.45, 0.04, 2.2, "wood"),
        post(6.7, 1.05, 0.04, 2.2, "wood"),
    )
    scatterers = (
        Scatterer((25.8, 0.3, 1.1), 13.0),
        Scatterer((25.7, -6.9, 1.0), 6.0),
        Scatterer((25.8, 6.0, 1.0), 8.0),
    )
    corners = Board(6.51, 0.9, 0.35, 0.30, 8, 5)
    return Scene("open-yard", "yard", "city", (*wall, *board), scatterers, _YARD, sun_azimuth_deg=150.0, board=corners)


def road() -> Scene:
    """Build a road on whose middle the sensors stand."""
    lamps = tuple(post(x, side * 8.2, 0.08, 6.5, "metal") for x in (12.0, 36.0, 60.0, 84.0) for side in (1.0, -1.0))
    kerbs = tuple(Box(60.0, side * 6.6, 120.0, 0.2, 0.12, "render") for side in (1.0, -1.0))
    signs = (post(24.0, -7.4, 0.04, 1.6, "metal"), Box(24.0, -7.4, 0.03, 0.8, 0.8, "blue", base_m=1.5))
    houses = (
        Box(40.0, 18.0, 14.0, 8.0, 6.0, "plaster"),
        Box(62.0, -20.0, 16.0, 9.0, 7.0, "brick"),
        Box(95.0, 17.0, 18.0, 9.0, 6.5, "brick"),
    )
    scatterers = tuple(Scatterer((one.x_m, one.y_m, 1.0), 3.0) for one in (*lamps, signs[0]) if one.x_m < 50.0)
    solids = (*lamps, *kerbs, *signs, *houses)
    return Scene("road", "road", "trees", solids, scatterers, replace(_ROOFTOP, max_lateral_m=5.5))


def scene_named(name: SceneName) -> Scene:
    """Return a scene by its name."""
    return _SCENES[name]()


def _corners(box: Box, z_m: float, rcs_dbsm: float) -> list[Scatterer]:
    """Return two scatterers at the edges of a box that face the radar."""
    near_m = box.x_m - box.length_m / 2
    inner_m = box.y_m - np.sign(box.y_m) * box.width_m / 2
    outer_m = box.y_m + np.sign(box.y_m) * box.width_m / 2
    return [
        Scatterer((near_m, float(inner_m), z_m), rcs_dbsm),
        Scatterer((near_m, float(outer_m), z_m), rcs_dbsm - 5.0),
    ]


def _rooftop() -> Scene:
    units = (
        Box(14.2, 6.6, 1.7, 2.4, 1.5, "louvre", base_m=0.15),
        Box(16.6, -5.9, 1.5, 2.6, 1.25, "louvre", base_m=0.15),
        Box(18.6, 1.2, 1.0, 1.5, 0.95, "louvre", base_m=0.15),
    )
    house = Box(20.0, 10.2, 4.4, 4.6, 2.9, "plaster")
    parapets = (
        Box(22.3, -1.0, 0.35, 26.0, 1.05, "render"),
        Box(10.0, -11.4, 25.0, 0.35, 1.05, "render"),
        Box(10.0, 11.6, 25.0, 0.35, 1.05, "render"),
    )
    copings = (
        Box(22.3, -1.0, 0.5, 26.0, 0.07, "metal", base_m=1.05),
        Box(10.0, -11.4, 25.0, 0.5, 0.07, "metal", base_m=1.05),
        Box(10.0, 11.6, 25.0, 0.5, 0.07, "metal", base_m=1.05),
    )
    plinths = tuple(Box(u.x_m, u.y_m, u.length_m - 0.3, u.width_m - 0.4, 0.15, "dark") for u in units)
    pipes = (
        post(9.6, 5.6, 0.11, 0.75, "metal"),
        post(9.6, 5.6, 0.17, 0.10, "metal", base_m=0.75),
        post(12.4, -6.4, 0.14, 0.95, "metal"),
        post(12.4, -6.4, 0.21, 0.12, "metal", base_m=0.95),
        post(20.6, -2.6, 0.045, 4.6, "metal"),
        post(21.2, 4.9, 0.16, 1.5, "metal"),
    )
    skylight = (Box(10.6, -8.7, 2.4, 1.5, 0.42, "white"), Box(10.6, -8.7, 2.1, 1.2, 0.08, "blue", base_m=0.42))
    door = (Box(17.79, 9.0, 0.06, 0.95, 2.05, "door"),)
    duct = (Box(17.2, 3.9, 0.45, 3.6, 0.4, "metal", base_m=0.35),)
    scatterers = [s for unit in units for s in _corners(unit, 0.8, 6.0)]
    scatterers += [
        Scatterer((9.6, 5.6, 0.5), -4.0),
        Scatterer((12.4, -6.4, 0.6), 0.0),
        Scatterer((20.6, -2.6, 1.2), 3.0),
        Scatterer((22.1, -0.4, 0.6), 12.0),
        Scatterer((22.1, 5.9, 0.5), 5.0),
        Scatterer((22.1, -8.2, 0.5), 5.0),
        Scatterer((17.8, 8.2, 1.2), 8.0),
        Scatterer((9.4, -8.0, 0.3), -2.0),
        Scatterer((17.0, 3.9, 0.5), 2.0),
    ]
    solids = (*parapets, *copings, *plinths, *units, house, *door, *pipes, *skylight, *duct)
    return Scene("rooftop", "tiles", "city", solids, tuple(scatterers), _ROOFTOP)


def _field() -> Scene:
    goal = (
        post(19.0, -3.66, 0.06, 2.44, "white"),
        post(19.0, 3.66, 0.06, 2.44, "white"),
        Box(19.0, 0.0, 0.12, 7.44, 0.12, "white", base_m=2.44),
    )
    fence = tuple(post(27.0, float(y), 0.05, 1.15, "wood") for y in range(-24, 25, 3))
    rails = (
        Box(27.0, 0.0, 0.05, 50.0, 0.09, "wood", base_m=0.95),
        Box(27.0, 0.0, 0.05, 50.0, 0.09, "wood", base_m=0.5),
    )
    bench = (
        Box(14.0, 8.0, 0.4, 1.7, 0.06, "wood", base_m=0.43),
        Box(14.15, 8.7, 0.35, 0.08, 0.43, "dark"),
        Box(14.15, 7.3, 0.35, 0.08, 0.43, "dark"),
        Box(14.22, 8.0, 0.05, 1.7, 0.3, "wood", base_m=0.55),
    )
    sign = (post(16.5, -7.6, 0.04, 1.3, "metal"), Box(16.5, -7.6, 0.03, 1.3, 0.7, "blue", base_m=1.25))
    scatterers = [
        Scatterer((19.0, -3.66, 1.0), 2.0),
        Scatterer((19.0, 3.66, 1.0), 2.0),
        Scatterer((14.0, 8.3, 0.4), -1.0),
        Scatterer((16.5, -7.6, 0.9), 1.0),
        *(Scatterer((27.0, float(y), 0.6), -3.0) for y in (-9, -3, 3, 9)),
    ]
    layout = PairsLayout(2.3, 17.5, 31.0, height_m=0.20, roughness_m=0.012, separation_m=0.9)
    return Scene("field", "grass", "trees", (*goal, *fence, *rails, *bench, *sign), tuple(scatterers), layout)


def _aisle() -> Scene:
    racks: list[Box] = []
    scatterers: list[Scatterer] = []
    for side in (1.0, -1.0):
        for bay in range(8):
            x_m = 2.6 + 2.2 * bay
            racks.append(Box(x_m, side * 2.35, 2.0, 0.95, 0.75, "cartons", base_m=0.14))
            racks.append(Box(x_m, side * 2.35, 2.0, 0.95, 0.70, "cartons", base_m=1.15))
            racks.append(Box(x_m + 1.1, side * 1.86, 0.1, 0.1, 2.9, "blue"))
            racks.append(Box(x_m, side * 1.86, 2.2, 0.06, 0.12, "yellow", base_m=1.02))
            racks.append(Box(x_m, side * 1.86, 2.2, 0.06, 0.12, "yellow", base_m=1.98))
            racks.append(Box(x_m, side * 2.4, 1.9, 0.9, 0.6, "cartons", base_m=2.1))
            scatterers.append(Scatterer((x_m + 1.1, side * 1.82, 0.9), 1.0 + 3.0 * (bay % 3)))
    cart = (
        Box(8.3, 1.12, 0.9, 0.6, 0.05, "blue", base_m=0.22),
        Box(8.3, 1.12, 0.75, 0.5, 0.42, "cartons", base_m=0.27),
        Box(8.75, 1.12, 0.04, 0.6, 0.95, "metal"),
    )
    pallet = (Box(13.0, -1.05, 1.0, 0.8, 0.14, "wood"), Box(13.0, -1.05, 0.9, 0.7, 0.6, "cartons", base_m=0.14))
    wall = (Box(21.0, 0.0, 0.3, 14.0, 4.2, "plaster"), Box(20.83, 0.0, 0.06, 2.4, 2.6, "door"))
    sides = (Box(10.0, 4.6, 24.0, 0.3, 4.2, "plaster"), Box(10.0, -4.6, 24.0, 0.3, 4.2, "plaster"))
    lamps = tuple(Box(4.0 + 4.0 * i, 0.0, 1.5, 0.28, 0.06, "lamp", base_m=3.9) for i in range(4))
    scatterers += [
        Scatterer((7.9, 1.0, 0.4), 6.0),
        Scatterer((12.5, -0.9, 0.3), 3.0),
        Scatterer((20.8, 0.2, 1.0), 14.0),
    ]
    layout = PairsLayout(2.3, 16.0, 31.0, max_lateral_m=0.75, height_m=0.19, roughness_m=0.003, separation_m=0.5)
    solids = (*racks, *cart, *pallet, *wall, *sides, *lamps)
    return Scene("aisle", "floor", "hall", solids, tuple(scatterers), layout, 165.0, 68.0, ceiling_m=4.2)


def _checkerboard() -> Scene:
    wall = (Box(11.5, 0.0, 0.4, 26.0, 4.4, "brick"),)
    board = (
        Box(11.26, 0.6, 0.08, 2.9, 2.1, "white", base_m=0.95),
        Box(11.22, 0.6, 0.02, 2.7, 1.8, "checkerboard", base_m=1.1),
    )
    things = (
        post(10.9, 5.6, 0.29, 0.88, "blue"),
        Box(10.9, -5.2, 0.8, 1.2, 0.14, "wood"),
        Box(10.9, -5.2, 0.7, 1.0, 0.75, "cartons", base_m=0.14),
        post(11.2, -2.9, 0.06, 4.4, "metal"),
        Box(11.24, -7.9, 0.08, 1.0, 2.1, "door"),
    )
    scatterers = (
        Scatterer((11.3, 0.1, 1.1), 13.0),
        Scatterer((10.7, 5.5, 0.5), 3.0),
        Scatterer((10.5, -5.0, 0.5), 5.0),
        Scatterer((11.2, -2.9, 1.2), 4.0),
        Scatterer((11.3, 3.4, 1.0), 2.0),
    )
    solids, corners, layout = (
        (*wall, *board, *things),
        Board(11.21, -0.75, 1.1, 0.30, 8, 5),
        replace(_YARD, max_range_m=9.6),
    )
    return Scene("checkerboard", "asphalt", "city", solids, scatterers, layout, sun_azimuth_deg=150.0, board=corners)


_SCENES: dict[SceneName, Callable[[], Scene]] = {
    "rooftop": _rooftop,
    "field": _field,
    "aisle": _aisle,
    "checkerboard": _checkerboard,
    "open-rooftop": open_rooftop,
    "open-yard": open_yard,
    "road": road,
}
