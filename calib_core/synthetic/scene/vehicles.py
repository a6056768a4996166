"""Robot cars and cars: their shape, as the camera sees it, and the places that the radar sees."""

import functools
from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.arrays import Flags, Points3, Values, Vector2, Vector3

VehicleKind = Literal["robot", "car"]
Colour = Literal["paint", "glass", "dark", "orange", "lamp", "tail"]

_SIZE_M: dict[VehicleKind, tuple[float, float, float]] = {"robot": (0.46, 0.36, 0.42), "car": (4.3, 1.8, 1.45)}
"""Length, width and height."""

_Block = tuple[float, float, float, float, float, float, Colour]
_BLOCKS: dict[VehicleKind, tuple[_Block, ...]] = {
    "robot": (
        (0.0, 0.0, 0.06, 0.23, 0.15, 0.15, "orange"),
        (0.0, 0.0, 0.21, 0.17, 0.12, 0.06, "dark"),
        (-0.10, 0.0, 0.27, 0.02, 0.02, 0.11, "dark"),
        (-0.10, 0.0, 0.38, 0.04, 0.05, 0.04, "lamp"),
    ),
    "car": (
        (0.0, 0.0, 0.18, 2.05, 0.82, 0.20, "dark"),
        (0.0, 0.0, 0.38, 2.15, 0.90, 0.50, "paint"),
        (-0.30, 0.0, 0.88, 1.25, 0.80, 0.48, "glass"),
        (-0.35, 0.0, 1.36, 1.05, 0.76, 0.09, "paint"),
        (2.14, 0.62, 0.60, 0.02, 0.18, 0.12, "lamp"),
        (2.14, -0.62, 0.60, 0.02, 0.18, 0.12, "lamp"),
        (-2.14, 0.66, 0.62, 0.02, 0.14, 0.14, "tail"),
        (-2.14, -0.66, 0.62, 0.02, 0.14, 0.14, "tail"),
    ),
}
"""Blocks: centre (forward, left), underside, half length, half width, height [m], colour; lower ones first."""

_WHEELS: dict[VehicleKind, tuple[float, float, float]] = {"robot": (0.15, 0.18, 0.07), "car": (1.32, 0.90, 0.32)}
"""Distance from the middle along and across, and radius [m]."""

_Echo = tuple[float, float, float, float, float, float]
_ECHOES: dict[VehicleKind, tuple[_Echo, ...]] = {
    "robot": (
        *((0.22 * f, 0.15 * s, 0.14, -2.0, 0.7 * f, 0.7 * s) for f in (1.0, -1.0) for s in (1.0, -1.0)),
        *((0.23 * f, 0.0, 0.16, 0.0, f, 0.0) for f in (1.0, -1.0)),
        *((0.0, 0.17 * s, 0.12, 0.0, 0.0, s) for s in (1.0, -1.0)),
        (-0.10, 0.0, 0.38, -5.0, 0.0, 0.0),
    ),
    "car": (
        *((2.05 * f, 0.80 * s, 0.5, 8.0, 0.7 * f, 0.7 * s) for f in (1.0, -1.0) for s in (1.0, -1.0)),
        *((1.32 * f, 0.88 * s, 0.32, 5.0, 0.0, s) for f in (1.0, -1.0) for s in (1.0, -1.0)),
        *((0.2, 0.88 * s, 0.7, 10.0, 0.0, s) for s in (1.0, -1.0)),
        (2.15, 0.0, 0.55, 10.0, 1.0, 0.0),
        (-2.15, 0.0, 0.60, 12.0, -1.0, 0.0),
        (0.95, 0.0, 0.95, 2.0, 1.0, 0.0),
        (-1.40, 0.0, 1.25, 2.0, -1.0, 0.0),
    ),
}
"""Places that the radar sees: forward, left, up [m], radar cross-section [dBsm], and the way they face; 0, 0 for every way."""


@dataclass(frozen=True, slots=True)
class VehicleState:
    """Where a vehicle is.

    Attributes:
        kind: what it is.
        x_m, y_m: its middle, in the world.
        heading_rad: where it drives; 0 along x, positive to the left.
        number: of its kind, from 1; it decides the paint.
    """

    kind: VehicleKind
    x_m: float
    y_m: float
    heading_rad: float
    number: int = 1

    @property
    def place_m(self) -> Vector2:
        """(2,) its middle on the ground."""
        return np.array([self.x_m, self.y_m])

    @property
    def size_m(self) -> tuple[float, float, float]:
        """Length, width and height."""
        return _SIZE_M[self.kind]

    def world(self, local_m: Points3) -> Points3:
        """Return points (n, 3), given forward, left and up of its middle on the ground, in the world."""
        return local_m @ self.axes + np.array([self.x_m, self.y_m, 0.0])

    @property
    def axes(self) -> np.ndarray:
        """Forward, left and up as rows (3, 3), in the world."""
        c, s = np.cos(self.heading_rad), np.sin(self.heading_rad)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A flat outline of a vehicle in the world.

    Attributes:
        corners_m: (n, 3) in order.
        normal: (3,) outward.
        colour: what it is painted with.
    """

    corners_m: Points3
    normal: Vector3
    colour: Colour


_FACES = (
    (np.array([1.0, 0.0, 0.0]), ((1, -1, 0), (1, 1, 0), (1, 1, 1), (1, -1, 1))),
    (np.array([-1.0, 0.0, 0.0]), ((-1, 1, 0), (-1, -1, 0), (-1, -1, 1), (-1, 1, 1))),
    (np.array([0.0, 1.0, 0.0]), ((1, 1, 0), (-1, 1, 0), (-1, 1, 1), (1, 1, 1))),
    (np.array([0.0, -1.0, 0.0]), ((-1, -1, 0), (1, -1, 0), (1, -1, 1), (-1, -1, 1))),
    (np.array([0.0, 0.0, 1.0]), ((1, -1, 1), (1, 1, 1), (-1, 1, 1), (-1, -1, 1))),
)


def vehicle_parts(state: VehicleState) -> tuple[Part, ...]:
    """Return the faces of a vehicle's blocks, lower blocks first, and its wheels after the lowest."""
    parts: list[Part] = []
    for number, (forward, left, base, half_length, half_width, height, colour) in enumerate(_BLOCKS[state.kind]):
        for normal, signs in _FACES:
            if colour in ("lamp", "tail") and forward * normal[0] <= 0.0 and state.kind == "car":
                continue  # only its glass is outside the body
            offsets = np.array(signs, dtype=np.float64) * [half_length, half_width, height]
            corners = np.array([forward, left, base]) + offsets
            parts.append(Part(state.world(corners), normal @ state.axes, colour))
        if number == (1 if state.kind == "car" else 0):
            parts += _wheels(state)
    return tuple(parts)


def outline_points(state: VehicleState) -> Points3:
    """Return points (n, 3) on the edges of a vehicle in the world; their pixels bound it."""
    return state.world(_local_outline(state.kind))


@functools.cache
def _local_outline(kind: VehicleKind) -> Points3:
    rings = [part.corners_m for part in vehicle_parts(VehicleState(kind, 0.0, 0.0, 0.0))]
    points = [ring + share * (np.roll(ring, -1, axis=0) - ring) for ring in rings for share in (0.0, 0.5)]
    return np.unique(np.concatenate(points).round(6), axis=0)


def _wheels(state: VehicleState) -> list[Part]:
    """Return the outer sides of the four wheels."""
    along, across, radius = _WHEELS[state.kind]
    turns = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    rim = np.stack([radius * np.cos(turns), np.zeros(16), radius + radius * np.sin(turns)], axis=1)
    found = []
    for forward in (1.0, -1.0):
        for side in (1.0, -1.0):
            corners = rim + np.array([forward * along, side * (across + 0.005), 0.0])
            found.append(Part(state.world(corners), side * state.axes[1], "dark"))
    return found


def echo_places(state: VehicleState, towards_m: Vector2) -> tuple[Flags, Points3, Values]:
    """Return which of a vehicle's echoes a radar above a place on the ground sees, where all are, and their strength.

    Args:
        state: the vehicle.
        towards_m: (2,) the radar, in the world.
    """
    table = np.array(_ECHOES[state.kind])
    places = state.world(table[:, :3])
    ways = np.column_stack([table[:, 4:6], np.zeros(len(table))]) @ state.axes
    sight = towards_m - places[:, :2]
    sight /= np.maximum(np.linalg.norm(sight, axis=1), 1e-9)[:, None]
    every_way = ~ways.any(axis=1)
    facing = np.sum(ways[:, :2] * sight, axis=1) > 0.15
    return np.asarray(every_way | facing), places, table[:, 3]


def hidden_by(state: VehicleState, eye_m: Vector3, points_m: Points3) -> Flags:
    """Return which points (n, 3) a vehicle's block hides from an eye; none of those on its own surface.

    Args:
        state: the vehicle.
        eye_m: (3,) where the eye is, in the world.
        points_m: in the world.
    """
    length, width, height = state.size_m
    half = np.array([0.5 * length - 0.05, 0.5 * width - 0.05])
    start = (eye_m - [state.x_m, state.y_m, 0.0]) @ state.axes.T
    ends = (points_m - [state.x_m, state.y_m, 0.0]) @ state.axes.T
    way = ends - start
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = (-half - start[:2]) / way[:, :2], (half - start[:2]) / way[:, :2]
    enter = np.fmax(np.fmin(first, second).max(axis=1), 0.0)
    leave = np.fmin(np.fmax(first, second).min(axis=1), 1.0)
    middle = start[2] + 0.5 * (enter + leave) * way[:, 2]
    outside = (np.abs(ends[:, :2]) > half + 0.12).any(axis=1)
    return np.asarray((enter < leave) & (middle < height) & outside)
