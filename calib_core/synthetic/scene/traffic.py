"""Who moves besides the person with the reflector: passers-by, people to be judged, robot cars in an aisle, cars on a road.

Of a vehicle: its shape, as the camera sees it, and the places that the radar sees.
"""

import functools
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Flags, Points2, Points3, Values, Vector2, Vector3, freeze, frozen_array
from calib_core.errors import OptionError
from calib_core.synthetic.options import Traffic
from calib_core.synthetic.scene.person import PersonState
from calib_core.synthetic.scene.scenes import Scene

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


ActorLabel: TypeAlias = Literal["person", "robot", "car"]

_WALKED_DEG = 27.0
"""How far to the side people walk: so far a camera of 75 deg sees them."""

_WALK_M = (2.6, 15.0)
_LANE_M = 3.2
_TURNING_MPS = 3.0
_BRAKING_MPS2 = 1.5
_STEP_M = 0.25


@dataclass(frozen=True, slots=True)
class Actor:
    """One moving object at one time.

    Attributes:
        track: the same at all times, such as "person-1".
        label: its class.
        state: where it is and how it stands.
    """

    track: str
    label: ActorLabel
    state: PersonState | VehicleState


@dataclass(frozen=True, slots=True, eq=False)
class Mover:
    """One object on its way, given at some times; between these it moves straight.

    Attributes:
        label: its class.
        number: of its class, from 1.
        times_s: (k,) of the story, ascending.
        places_m: (k, 2) on the ground, in the world.
        headings_rad: (k,) where it faces, without jumps.
        walked_m: (k,) how far it has come.
    """

    label: ActorLabel
    number: int
    times_s: Values
    places_m: Points2
    headings_rad: Values
    walked_m: Values = field(init=False)

    def __post_init__(self) -> None:
        k = len(self.times_s)
        freeze(self, times_s=(k,), places_m=(k, 2))
        object.__setattr__(self, "headings_rad", frozen_array(np.unwrap(self.headings_rad), (k,)))
        steps = np.linalg.norm(np.diff(self.places_m, axis=0), axis=1)
        object.__setattr__(self, "walked_m", frozen_array(np.concatenate([[0.0], np.cumsum(steps)]), (k,)))

    @property
    def track(self) -> str:
        """The object's name in boxes and labels."""
        return f"{self.label}-{self.number}"

    def at(self, time_s: float) -> Actor:
        """Return the object at a time."""
        x_m, y_m, heading_rad, walked_m = (
            float(np.interp(time_s, self.times_s, values))
            for values in (*self.places_m.T, self.headings_rad, self.walked_m)
        )
        if self.label != "person":
            return Actor(self.track, self.label, VehicleState(self.label, x_m, y_m, heading_rad, self.number))
        around = np.interp([time_s - 0.15, time_s + 0.15], self.times_s, self.walked_m)
        pace = float(np.clip((around[1] - around[0]) / 0.27, 0.0, 1.0))
        return Actor(self.track, self.label, PersonState(x_m, y_m, heading_rad, walked_m, pace))


def draw_movers(rng: np.random.Generator, traffic: Traffic, scene: Scene, duration_s: float) -> tuple[Mover, ...]:
    """Draw where everybody goes during the story.

    Args:
        rng: the only source of randomness.
        traffic: who moves.
        scene: its solids are in the way.
        duration_s: of the story.
    """
    walkers = [_wandering(rng, "person", number + 1, scene, duration_s) for number in range(traffic.walkers)]
    robots = [_wandering(rng, "robot", number + 1, scene, duration_s) for number in range(traffic.robots)]
    cars = [_round_trip(rng, number + 1, traffic, duration_s) for number in range(traffic.cars)]
    return (*walkers, *robots, *cars)


def _wandering(
    rng: np.random.Generator, label: Literal["person", "robot"], number: int, scene: Scene, duration_s: float
) -> Mover:
    """Let a person or a robot go from place to place, turn there, and sometimes wait."""
    speed_mps = float(rng.uniform(0.9, 1.4) if label == "person" else rng.uniform(0.6, 0.9))
    clearance_m = 0.45 if label == "person" else 0.3
    here = _place(rng, scene, label, clearance_m)
    times, places, headings = [0.0], [here], [float(rng.uniform(-np.pi, np.pi))]
    while times[-1] < duration_s + 1.0:
        there = _next_place(rng, scene, label, here, clearance_m)
        way = there - here
        heading = float(np.arctan2(way[1], way[0]))
        waits_s = float(rng.uniform(1.0, 2.0)) if rng.uniform() < 0.2 else 0.0
        turns_s = 0.3 + 0.25 * abs((heading - headings[-1] + np.pi) % (2.0 * np.pi) - np.pi)
        for passed_s, place, faces in (
            (waits_s + 1e-3, here, headings[-1]),
            (turns_s, here, heading),
            (float(np.linalg.norm(way)) / speed_mps, there, heading),
        ):
            times.append(times[-1] + passed_s)
            places.append(place)
            headings.append(faces)
        here = there
    return Mover(label, number, np.array(times), np.array(places), np.array(headings))


def _next_place(
    rng: np.random.Generator, scene: Scene, label: ActorLabel, here: Vector2, clearance_m: float
) -> Vector2:
    """Draw where to go next: some metres away, with nothing in between.

    Raises:
        OptionError: there is no way out.
    """
    for _ in range(500):
        there = _place(rng, scene, label, clearance_m)
        steps = np.linspace(0.0, 1.0, 40)[:, None] * (there - here) + here
        if np.linalg.norm(there - here) > 2.0 and all(scene.free(step, clearance_m) for step in steps):
            return there
    raise OptionError(f"no room to move in the {scene.name}: ask for another scene")


def _place(rng: np.random.Generator, scene: Scene, label: ActorLabel, clearance_m: float) -> Vector2:
    """Draw a place that is free and in front of the camera."""
    layout = scene.layout
    for _ in range(500):
        x_m = float(rng.uniform(_WALK_M[0], min(_WALK_M[1], layout.max_range_m)))
        aside_m = min(
            x_m * float(np.tan(np.deg2rad(_WALKED_DEG))), layout.max_lateral_m * (0.8 if label == "robot" else 1.0)
        )
        place = np.array([x_m, float(rng.uniform(-aside_m, aside_m))])
        if scene.free(place, clearance_m):
            return place
    raise OptionError(f"no room to move in the {scene.name}: ask for another scene")


def _round_trip(rng: np.random.Generator, number: int, traffic: Traffic, duration_s: float) -> Mover:
    """Let a car drive away on the right, turn at the far end, come back on the left and turn at the near end."""
    near_m, far_m = traffic.nearest_m + _LANE_M, traffic.farthest_m - _LANE_M
    half_turn_m = np.pi * _LANE_M
    round_m = 2.0 * (far_m - near_m + half_turn_m)
    top_mps = 4.0 if far_m - near_m < 20.0 else 10.0
    start_m = round_m * (number - 1 + 0.3 * float(rng.uniform())) / traffic.cars
    times, places, headings = [0.0], [], []
    along_m = start_m
    while True:
        place, heading, straight_left_m = _on_round(along_m % round_m, near_m, far_m)
        places.append(place)
        headings.append(heading)
        if times[-1] > duration_s + 1.0:
            return Mover("car", number, np.array(times), np.array(places), np.array(headings))
        speed_mps = min(top_mps, float(np.sqrt(_TURNING_MPS**2 + 2.0 * _BRAKING_MPS2 * straight_left_m)))
        times.append(times[-1] + _STEP_M / speed_mps)
        along_m += _STEP_M


def _on_round(along_m: float, near_m: float, far_m: float) -> tuple[Vector2, float, float]:
    """Return place and heading on the round, and the distance to the nearer end of the straight part."""
    straight_m, half_turn_m = far_m - near_m, np.pi * _LANE_M
    if along_m < straight_m:
        return np.array([near_m + along_m, -_LANE_M]), 0.0, min(along_m, straight_m - along_m)
    along_m -= straight_m
    if along_m < half_turn_m:
        turn = along_m / _LANE_M
        return np.array([far_m + _LANE_M * np.sin(turn), -_LANE_M * np.cos(turn)]), turn, 0.0
    along_m -= half_turn_m
    if along_m < straight_m:
        return np.array([far_m - along_m, _LANE_M]), np.pi, min(along_m, straight_m - along_m)
    turn = (along_m - straight_m) / _LANE_M
    return np.array([near_m - _LANE_M * np.sin(turn), _LANE_M * np.cos(turn)]), np.pi + turn, 0.0


_STOPPING = 3
"""Every third passer-by stops."""


@dataclass(frozen=True, slots=True, eq=False)
class PasserBy:
    """One person on a straight way through the scene; times are seconds of the story.

    Attributes:
        start_s: when they set off.
        from_m: (2,) where, in the world.
        to_m: (2,) where they walk to, and leave the scene.
        speed_mps: how fast they walk.
        stop_s: how long they stand still half way.
    """

    start_s: float
    from_m: Vector2
    to_m: Vector2
    speed_mps: float
    stop_s: float

    def __post_init__(self) -> None:
        freeze(self, from_m=(2,), to_m=(2,))

    def at(self, time_s: float) -> PersonState | None:
        """Return the person at a time; None before they come and after they have left."""
        way = self.to_m - self.from_m
        length_m = float(np.linalg.norm(way))
        half_s = 0.5 * length_m / self.speed_mps
        since_s = time_s - self.start_s
        if not 0.0 <= since_s <= 2.0 * half_s + self.stop_s:
            return None
        stopped_s = min(max(since_s - half_s, 0.0), self.stop_s)
        walked_m = self.speed_mps * (since_s - stopped_s)
        place = self.from_m + walked_m / length_m * way
        standing = 0.0 < stopped_s < self.stop_s
        heading_rad = float(np.arctan2(way[1], way[0]))
        return PersonState(float(place[0]), float(place[1]), heading_rad, walked_m, 0.0 if standing else 1.0)


def draw_passers_by(
    rng: np.random.Generator, count: int, duration_s: float, max_range_m: float
) -> tuple[PasserBy, ...]:
    """Draw people who cross the scene from one side to the other, spread over the story.

    Args:
        rng: the only source of randomness.
        count: how many.
        duration_s: of the story.
        max_range_m: of the placements; people cross nearer than that.
    """
    found = []
    for number in range(count):
        side = 1.0 if rng.uniform() < 0.5 else -1.0
        first_m, second_m = rng.uniform(4.0, max(5.0, max_range_m), 2)
        aside_m = 0.8 * np.array([first_m, second_m]) + 2.0  # outside a camera of 75 deg
        found.append(
            PasserBy(
                start_s=(number + float(rng.uniform(0.0, 0.7))) * duration_s / count,
                from_m=np.array([first_m, side * aside_m[0]]),
                to_m=np.array([second_m, -side * aside_m[1]]),
                speed_mps=float(rng.uniform(1.1, 1.6)),
                stop_s=float(rng.uniform(3.0, 6.0)) if number % _STOPPING == _STOPPING - 1 else 0.0,
            )
        )
    return tuple(found)
