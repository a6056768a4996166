"""The example clicks: as a careful person makes them, or twice, low, late and in haste."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from calib_core.arrays import Vector2
from calib_core.measurements import ReflectorClick, TimeNs
from calib_core.synthetic.scene.stage import SimulatedPlacement, Stage, child_rng, clear_frames

ClickFault = Literal["repeated", "low", "late", "hasty"]


@dataclass(frozen=True, slots=True)
class SimulatedClick:
    """An example click and the truth about it.

    Attributes:
        click: as a session has it.
        placement_id: of the placement whose reflector was clicked.
        faults: what is wrong with it; "late" and "hasty" make it useless, "repeated" and "low" do not.
    """

    click: ReflectorClick
    placement_id: str
    faults: tuple[ClickFault, ...] = ()


@dataclass(frozen=True, slots=True)
class _Intention:
    """A click before it has a pixel: of placement number `index`, in a frame; `count` counts its earlier clicks."""

    index: int
    time: TimeNs
    count: int
    late: bool


def clicks_of(stage: Stage, placements: tuple[SimulatedPlacement, ...]) -> tuple[SimulatedClick, ...]:
    """Click each placement as the options say; ids "c1", "c2", ... in order of placements."""
    options = stage.options
    noise = options.click_sigma_px * child_rng(options, 8).standard_normal((len(placements), 2))
    rng = child_rng(options, 17)  # for whatever the default does not do
    intentions = _intentions(rng, stage, placements)
    if not intentions:
        return ()
    first = min(intentions, key=lambda intention: intention.time)
    clicks = []
    for number, one in enumerate(intentions):
        placement = placements[one.index]
        error = noise[one.index] if one.count == 0 else options.click_sigma_px * rng.standard_normal(2)
        pixel = _aimed_at(stage, one.index, placement) + error
        faults: list[ClickFault] = ["repeated"] if one.count else []
        if options.clicking.low_px or options.clicking.low_m:
            faults.append("low")
        if one.late:
            faults.append("late")
        if options.clicking.hasty_first_px and one is first:
            turn = rng.uniform(0.0, 2.0 * np.pi)
            pixel = pixel + options.clicking.hasty_first_px * np.array([np.cos(turn), np.sin(turn)])
            faults.append("hasty")
        click = ReflectorClick(one.time, f"c{number + 1}", round(float(pixel[0]), 2), round(float(pixel[1]), 2))
        clicks.append(SimulatedClick(click, placement.id, tuple(faults)))
    return tuple(clicks)


def _aimed_at(stage: Stage, index: int, placement: SimulatedPlacement) -> Vector2:
    """Return the pixel that is clicked without noise."""
    clicking = stage.options.clicking
    if not (clicking.low_m or clicking.low_px):
        return placement.pixel_px
    point = stage.story.restings[index].position_m - np.array([0.0, 0.0, clicking.low_m])
    pixel = stage.rig.camera.project(stage.rig.camera_from_world @ point[None])[0]
    return np.asarray(pixel + np.array([0.0, clicking.low_px]))


def _intentions(rng: np.random.Generator, stage: Stage, placements: tuple[SimulatedPlacement, ...]) -> list[_Intention]:
    """Decide which placement is clicked in which frame; a frame has at most one click."""
    clicking = stage.options.clicking
    taken = {placement.best_image_time for placement in placements}
    intentions: list[_Intention] = []
    for index, placement in enumerate(placements):
        times = [placement.best_image_time]
        for _ in range(clicking.clicks_per_placement - 1):
            times += _other_frame(rng, stage, index, taken)
        for count, time in enumerate(times):
            late = bool(clicking.late_share) and float(rng.uniform()) < clicking.late_share
            later = _other_frame(rng, stage, index + stage.options.reflectors, taken) if late else []
            intentions.append(_Intention(index, later[0] if later else time, count, bool(later)))
    return intentions


def _other_frame(rng: np.random.Generator, stage: Stage, index: int, taken: set[TimeNs]) -> list[TimeNs]:
    """Draw a clear frame of a placement that has no click yet, and take it; an empty list if there is none."""
    if index >= len(stage.story.restings):
        return []
    free = [time for time in clear_frames(stage, stage.story.restings[index]) if time not in taken]
    if not free:
        return []
    time = free[int(rng.integers(len(free)))]
    taken.add(time)
    return [time]
