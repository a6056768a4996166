"""What the person does, one leg after the other: walk, put the reflector down, stand aside or leave, pick it up."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from calib_core.arrays import Vector2

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
        self.legs.append(
            Leg(
                self.time_s,
                end_s,
                self.place_m,
                to_m,
                self.heading_rad,
                action,
                carrying,
                self.walked_m,
                placement,
            )
        )
        self.time_s, self.place_m = end_s, to_m
