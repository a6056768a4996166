"""The story: a person carries the reflector from placement to placement and steps away each time.

Several reflectors are carried in turn: the one that has stood longest goes to the next placement.
Times here are seconds from the start of the recording.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from calib_core.arrays import Values, Vector2, Vector3
from calib_core.synthetic.scene.passers_by import PasserBy
from calib_core.synthetic.scene.person import PersonState, hand_position
from calib_core.synthetic.scene.script import PUT_DOWN_S, STEP_AWAY_S, Leg, Script
from calib_core.synthetic.scene.traffic import Actor, Mover

_LEAD_IN_S = 0.6
_TURNING_S = 0.5
_BEHIND_M = 0.52
"""How far behind the reflector, seen from the radar, the person stands to put it down."""
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
        traffic = tuple(mover.at(time_s) for mover in self.movers)
        if not self.restings:
            return Moment(_NOBODY, np.zeros(3), 0.0, None, 0.0, traffic=traffic)
        moment = self._moment(time_s)
        if time_s < self.lead_s:
            moment = replace(moment, reflector_m=_BEHIND_SENSORS_M, resting=None)
        if traffic:
            moment = replace(moment, traffic=traffic)
        resting = [one for one in self.restings if one.start_s <= time_s < one.end_s and one is not moment.resting]
        passing = [state for one in self.passers_by if (state := one.at(time_s)) is not None]
        return replace(moment, standing=tuple(resting), passers_by=tuple(passing)) if resting or passing else moment

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
        held = hand_position(_upright(person)) + np.array([0.0, 0.0, 0.03])
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


def _upright(person: PersonState) -> PersonState:
    return PersonState(person.x_m, person.y_m, person.heading_rad, carrying=True)


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


def _in_order(positions: np.ndarray, start_m: Vector2) -> list[int]:
    """Return a short walk through all positions: always to the nearest one left."""
    left, here, order = set(range(len(positions))), start_m, []
    while left:
        nearest = min(left, key=lambda i: (float(np.linalg.norm(positions[i, :2] - here)), i))
        order.append(nearest)
        here = positions[nearest, :2]
        left.remove(nearest)
    return order


def tell_story(
    rng: np.random.Generator,
    *,
    positions_m: np.ndarray,
    dwell_s: float,
    narrow: bool = False,
    start_m: tuple[float, float] = (2.6, -1.2),
    reflectors: int = 1,
    leaves: bool = False,
    waving_s: float = 0.0,
) -> Story:
    """Let a person carry the reflector to each position, always to the nearest one next.

    Args:
        rng: the only source of randomness.
        positions_m: (n, 3) apex positions in the world, in any order.
        dwell_s: from releasing the reflector to picking it up; with several, to picking up another one.
        narrow: the person steps back, not to the side.
        start_m: where the person comes from, and where further reflectors wait.
        reflectors: how many, carried in turn; the last ones stay until the end.
        leaves: the person walks behind the sensors for that time instead of stepping aside.
        waving_s: how long the person waves a board before that; the reflector is fetched from behind the sensors then.
    """
    script = _waved_script(waving_s) if waving_s else Script(np.array(start_m))
    lead_s = script.time_s
    restings: list[Resting] = []
    stands: list[Vector2] = []
    for index, chosen in enumerate(_in_order(positions_m, script.place_m)):
        position = positions_m[chosen]
        away = position[:2] / np.linalg.norm(position[:2])
        stands.append(position[:2] + _BEHIND_M * away)
        start_s = script.put_down(stands[index], index, position[:2])
        aside_m = _aside(rng, stands[index], away, narrow)
        if leaves:
            script.leave(stands[index], dwell_s, index, position[:2])
        else:
            script.wait(aside_m, dwell_s, index, position[:2])
        facing_rad = float(np.arctan2(-away[1], -away[0]) + np.deg2rad(6.0) * rng.standard_normal())
        left_s = script.time_s if reflectors > 1 else math.inf
        restings.append(Resting(index, start_s, math.inf, position, facing_rad, left_s))
        taken = index + 1 - reflectors
        if taken < 0:
            script.walk(np.array(start_m), carrying=False, placement=index)
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


def _aside(rng: np.random.Generator, behind: Vector2, away: Vector2, narrow: bool) -> Vector2:
    """Choose where the person waits: to one side and slightly behind, or in a narrow place straight behind."""
    if narrow:
        return behind + rng.uniform(1.3, 1.7) * away + np.array([0.0, rng.uniform(-0.3, 0.3)])
    side = 1.0 if rng.uniform() < 0.5 else -1.0
    across = np.array([-away[1], away[0]]) * side
    return behind + rng.uniform(1.2, 1.7) * across + rng.uniform(0.0, 0.5) * away
