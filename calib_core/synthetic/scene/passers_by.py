"""People who walk through the scene and have nothing to do with the calibration."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector2, frozen_array
from calib_core.synthetic.scene.person import PersonState

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
        for name in ("from_m", "to_m"):
            object.__setattr__(self, name, frozen_array(getattr(self, name), (2,)))

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
    rng: np.random.Generator, count: int, *, duration_s: float, max_range_m: float
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
