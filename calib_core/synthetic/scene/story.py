"""The story: a person carries the reflector from placement to placement and steps away each time.

Several reflectors are carried in turn: the one that has stood longest goes to the next placement.
Times here are seconds from the start of the recording.
"""

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Points3, Values, Vector2, Vector3
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.scene.person import PersonState, hand_position
from calib_core.synthetic.scene.traffic import Actor, Mover, PasserBy

_SPEED_MPS = 1.25
PUT_DOWN_S = 0.8
"""How long putting the reflector down or picking it up takes."""
STEP_AWAY_S = 1.3
"""How long stepping aside takes."""
_AROUND_M = 0.7
_GONE_M = np.array([-1.4, 0.9])
"""Where the person waits who leaves: behind the sensors."""

Action: TypeAlias = Literal["walk", "stand", "put", "pick"]
"""What the person does on a leg."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A part of the person's way: from one time and place to another, turned and busy in one way.

    Attributes:
        start_s, end_s: of the story.
        start_m, end_m: (2,) on the ground.
        heading_rad: where the person faces.
        action: what the person does.
        carrying: whether the reflector is in the person's hands all the time.
        walked_m: the way walked before.
        placement: number of the placement that it belongs to; -1 for none.
    """

    start_s: float
    end_s: float
    start_m: Vector2
    end_m: Vector2
    heading_rad: float
    action: Action
    carrying: bool
    walked_m: float
    placement: int


class Script:
    """Collects legs one after the other."""

    def __init__(self, place_m: Vector2) -> None:
        self.legs: list[Leg] = []
        self.time_s = 0.0
        self.walked_m = 0.0
        self.place_m = place_m
        self.heading_rad = 0.0

    def walk(self, to_m: Vector2, *, carrying: bool, placement: int = -1, duration_s: float | None = None) -> None:
        """Walk to a place."""
        step = to_m - self.place_m
        length_m = float(np.linalg.norm(step))
        if length_m > 0.05:
            self.heading_rad = float(np.arctan2(step[1], step[0]))
        self._add("walk", to_m, duration_s or 0.5 + length_m / _SPEED_MPS, carrying, placement)
        self.walked_m += length_m

    def stay(self, action: Action, duration_s: float, *, carrying: bool, placement: int, facing_m: Vector2) -> None:
        """Stay and do something, with the face to a place."""
        look = facing_m - self.place_m
        self.heading_rad = float(np.arctan2(look[1], look[0]))
        self._add(action, self.place_m, duration_s, carrying, placement)

    def put_down(self, stand_m: Vector2, placement: int, apex_m: Vector2) -> float:
        """Carry the reflector to a placement and put it down; return when it is released."""
        self.walk(stand_m, carrying=True, placement=placement)
        self.stay("put", PUT_DOWN_S, carrying=False, placement=placement, facing_m=apex_m)
        return self.time_s

    def wait(self, aside_m: Vector2, dwell_s: float, placement: int, apex_m: Vector2) -> None:
        """Step aside and stand there, until it is time to come back."""
        self.walk(aside_m, carrying=False, placement=placement, duration_s=STEP_AWAY_S)
        wait_s = dwell_s - 2.0 * STEP_AWAY_S
        self.stay("stand", wait_s, carrying=False, placement=placement, facing_m=apex_m)

    def leave(self, stand_m: Vector2, dwell_s: float, placement: int, apex_m: Vector2) -> None:
        """Go around the reflector and behind the sensors, stay there, and come back."""
        away = stand_m / np.linalg.norm(stand_m)
        aside_m = stand_m + _AROUND_M * np.array([-away[1], away[0]]) * (-1.0 if stand_m[1] > 0.0 else 1.0)
        for place in (aside_m, _GONE_M):
            self.walk(place, carrying=False, placement=placement)
        self.stay("stand", dwell_s, carrying=False, placement=placement, facing_m=apex_m)
        self.walk(aside_m, carrying=False, placement=placement)

    def _add(self, action: Action, to_m: Vector2, duration_s: float, carrying: bool, placement: int) -> None:
        end_s = self.time_s + duration_s
        way = (self.time_s, end_s, self.place_m, to_m)
        self.legs.append(Leg(*way, self.heading_rad, action, carrying, self.walked_m, placement))
        self.time_s, self.place_m = end_s, to_m


_LEAD_IN_S = 0.6
_TURNING_S = 0.5
_BEHIND_M = 0.52
"""How far behind the reflector, seen from the radar, the person stands to put it down."""
_START_M = np.array([2.6, -1.2])
"""Where the person comes from, and where further reflectors wait."""
_WAVING_M = np.array([0.95, 0.0])
"""Where the person stands who waves a board."""
_PAST_MAST_M = np.array([1.1, 1.0])
"""Where the person goes round the sensors."""
_BEHIND_SENSORS_M = np.array([-1.4, 0.9, 0.19])
"""Where the reflector waits meanwhile."""
_NOBODY = PersonState(-3.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Resting:
    """One placement: the reflector rests at a position from start to end.

    Attributes:
        index: its number, from 0.
        start_s: when it is released.
        end_s: when it is picked up again.
        position_m: (3,) the apex in the world.
        facing_rad: where the reflector faces, as a heading in the world.
        left_alone_s: when the person turns to another reflector, if there are several.
    """

    index: int
    start_s: float
    end_s: float
    position_m: Vector3
    facing_rad: float
    left_alone_s: float = math.inf


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """The person and the reflector at one time.

    Attributes:
        person: the state of the person.
        reflector_m: (3,) its apex in the world.
        facing_rad: where it faces, as a heading in the world.
        resting: the placement it rests at; None while the person holds it.
        next_height_m: height of the apex at the present, previous or next placement.
        standing: the placements of the other reflectors.
        passers_by: people who walk through the scene.
        traffic: who is there to be judged.
    """

    person: PersonState
    reflector_m: Vector3
    facing_rad: float
    resting: Resting | None
    next_height_m: float
    standing: tuple[Resting, ...] = ()
    passers_by: tuple[PersonState, ...] = ()
    traffic: tuple[Actor, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Story:
    """The movements of person and reflector during the whole recording."""

    restings: tuple[Resting, ...]
    duration_s: float
    _legs: tuple[Leg, ...]
    _ends_s: Values
    passers_by: tuple[PasserBy, ...] = ()
    movers: tuple[Mover, ...] = ()
    lead_s: float = 0.0
    """How long the person waves a board, before the reflector is fetched from behind the sensors."""

    def at(self, time_s: float) -> Moment:
        """Return the person and the reflectors at a time."""
        moment = self._moment(time_s) if self.restings else Moment(_NOBODY, np.zeros(3), 0.0, None, 0.0)
        if time_s < self.lead_s:
            moment = replace(moment, reflector_m=_BEHIND_SENSORS_M, resting=None)
        standing = (
            resting
            for resting in self.restings
            if resting.start_s <= time_s < resting.end_s and resting is not moment.resting
        )
        passing = (state for one in self.passers_by if (state := one.at(time_s)) is not None)
        traffic = (mover.at(time_s) for mover in self.movers)
        return replace(moment, standing=tuple(standing), passers_by=tuple(passing), traffic=tuple(traffic))

    def people_at(self, time_s: float, *, person: bool) -> tuple[Actor, ...]:
        """Return the people besides the traffic, each with a name: who carries the reflector, if shown, and passers-by."""
        number = 1 + sum(mover.label == "person" for mover in self.movers)
        found = [Actor(f"person-{number}", "person", self._moment(time_s).person)] if person and self.restings else []
        for passer_by in self.passers_by:
            number += 1
            state = passer_by.at(time_s)
            if state is not None:
                found.append(Actor(f"person-{number}", "person", state))
        return tuple(found)

    def _moment(self, time_s: float) -> Moment:
        number = min(int(np.searchsorted(self._ends_s, time_s, side="right")), len(self._legs) - 1)
        leg = self._legs[number]
        person = _person(leg, self._legs[number - 1] if number else leg, time_s)
        resting = self.restings[min(max(leg.placement, 0), len(self.restings) - 1)]
        height_m = float(resting.position_m[2])
        held = hand_position(PersonState(person.x_m, person.y_m, person.heading_rad, carrying=True)) + np.array(
            [0.0, 0.0, 0.03]
        )
        if leg.carrying:
            return Moment(person, held, person.heading_rad, None, height_m)
        if leg.action in ("put", "pick"):
            share = _eased((time_s - leg.start_s) / (leg.end_s - leg.start_s))
            down = share if leg.action == "put" else 1.0 - share
            place = (1.0 - down) * held + down * resting.position_m
            facing = person.heading_rad + down * _turn(resting.facing_rad - person.heading_rad)
            return Moment(person, place, facing, None, height_m)
        return Moment(person, resting.position_m, resting.facing_rad, resting, height_m)


def _turn(angle_rad: float) -> float:
    """Wrap an angle to -pi to pi."""
    return float((angle_rad + np.pi) % (2.0 * np.pi) - np.pi)


def _eased(share: float) -> float:
    s = min(1.0, max(0.0, share))
    return s * s * s * (s * (6.0 * s - 15.0) + 10.0)


def _person(leg: Leg, before: Leg, time_s: float) -> PersonState:
    share = (time_s - leg.start_s) / max(leg.end_s - leg.start_s, 1e-9)
    eased = _eased(share)
    place = leg.start_m + eased * (leg.end_m - leg.start_m)
    length_m = float(np.linalg.norm(leg.end_m - leg.start_m))
    pace = min(1.0, 4.0 * eased * (1.0 - eased) * 1.6) if leg.action == "walk" else 0.0
    crouch = 0.0
    if leg.action in ("put", "pick"):
        crouch = _eased(1.25 * (share if leg.action == "put" else 1.0 - share))
    holding = leg.carrying or leg.action in ("put", "pick")
    turned = _eased((time_s - leg.start_s) / _TURNING_S)
    heading = before.heading_rad + turned * _turn(leg.heading_rad - before.heading_rad)
    if leg.action == "stand":  # people do not stand still: sway by a centimetre
        place = place + 0.008 * np.array([np.sin(1.9 * time_s), np.cos(1.3 * time_s)])
    return PersonState(
        float(place[0]), float(place[1]), heading, leg.walked_m + eased * length_m, pace, crouch, holding
    )


def _in_order(positions: np.ndarray, start_m: Vector2, together: int) -> list[int]:
    """Return a short walk through all positions, so many together at a time: always to the nearest ones left."""
    left, here, order = set(range(0, len(positions), together)), start_m, list[int]()
    while left:
        nearest = min(left, key=lambda i: (float(np.linalg.norm(positions[i, :2] - here)), i))
        order += range(nearest, min(nearest + together, len(positions)))
        here = positions[order[-1], :2]
        left.remove(nearest)
    return order


def tell_story(rng: np.random.Generator, positions_m: Points3, options: SimulationOptions, *, narrow: bool) -> Story:
    """Let a person carry the reflector to each position, always to the nearest one next.

    Several reflectors are carried in turn; the last ones stay until the end. Those of one scene follow each other.

    Args:
        rng: the only source of randomness.
        positions_m: (n, 3) apex positions in the world, in any order.
        options: what the person does.
        narrow: the person steps back, not to the side.
    """
    reflectors, dwell_s = options.reflectors, options.dwell_s
    script = _waved_script(options.waved_board_s) if options.waved_board_s else Script(_START_M)
    together = 1 if options.reflectors_apart_m is None else reflectors
    lead_s = script.time_s
    restings: list[Resting] = []
    stands: list[Vector2] = []
    for index, chosen in enumerate(_in_order(positions_m, script.place_m, together)):
        position = positions_m[chosen]
        away = position[:2] / np.linalg.norm(position[:2])
        stands.append(position[:2] + _BEHIND_M * away)
        start_s = script.put_down(stands[index], index, position[:2])
        aside_m = _waiting_place(rng, stands[index], away, narrow)
        if options.person_leaves:
            script.leave(stands[index], dwell_s, index, position[:2])
        else:
            script.wait(aside_m, dwell_s, index, position[:2])
        facing_rad = float(np.arctan2(-away[1], -away[0]) + np.deg2rad(6.0) * rng.standard_normal())
        left_s = script.time_s if reflectors > 1 else math.inf
        restings.append(Resting(index, start_s, math.inf, position, facing_rad, left_s))
        taken = index + 1 - reflectors
        if taken < 0:
            script.walk(_START_M, carrying=False, placement=index)
            continue
        quickly_s = STEP_AWAY_S if taken == index else None
        script.walk(stands[taken], carrying=False, placement=index, duration_s=quickly_s)
        restings[taken] = replace(restings[taken], end_s=script.time_s)
        script.stay("pick", PUT_DOWN_S, carrying=False, placement=taken, facing_m=restings[taken].position_m[:2])
    home = script.place_m + np.array([-1.0, 1.5 if script.place_m[1] < 0 else -1.5])
    script.walk(home, carrying=len(restings) >= reflectors, placement=len(restings) - 1)
    duration_s = script.time_s + _LEAD_IN_S
    restings = [replace(resting, end_s=min(resting.end_s, duration_s)) for resting in restings]
    ends_s = np.array([leg.end_s for leg in script.legs])
    return Story(tuple(restings), duration_s, tuple(script.legs), ends_s, lead_s=lead_s)


def _waved_script(waving_s: float) -> Script:
    """Begin with a person who waves a board and then goes for the reflector."""
    script = Script(_WAVING_M)
    script.stay("stand", waving_s, carrying=True, placement=-1, facing_m=np.zeros(2))
    script.walk(_PAST_MAST_M, carrying=True)
    script.walk(_BEHIND_SENSORS_M[:2], carrying=True)
    return script


def _waiting_place(rng: np.random.Generator, behind: Vector2, away: Vector2, narrow: bool) -> Vector2:
    """Choose where the person waits: to one side and slightly behind, or in a narrow place straight behind."""
    if narrow:
        return behind + rng.uniform(1.3, 1.7) * away + np.array([0.0, rng.uniform(-0.3, 0.3)])
    side = 1.0 if rng.uniform() < 0.5 else -1.0
    across = np.array([-away[1], away[0]]) * side
    return behind + rng.uniform(1.2, 1.7) * across + rng.uniform(0.0, 0.5) * away
