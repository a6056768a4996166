"""The truth about each placement: where and when the reflector stood, and in which frames it can be clicked."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector2, Vector3, frozen_array
from calib_core.errors import OptionError
from calib_core.measurements import TimeNs
from calib_core.synthetic.scene.person import PersonState, capsules
from calib_core.synthetic.scene.stage import Stage
from calib_core.synthetic.scene.story import Resting
from calib_core.synthetic.scene.vehicles import VehicleState, hidden_by

_CLEARANCE_M = 0.16
"""How far a limb must be from the line of sight for all of the reflector to be visible."""


@dataclass(frozen=True, slots=True, eq=False)
class SimulatedPlacement:
    """The truth about one placement.

    Attributes:
        id: "placement-01" and so on.
        start: when the reflector is released, on the camera's clock.
        end: when it is picked up again.
        position_radar_m: (3,) its apex, which is its phase centre.
        pixel_px: (2,) where the camera sees that apex.
        best_image_time: stamp of the frame nearest to the middle of the dwell with nobody in front.
    """

    id: str
    start: TimeNs
    end: TimeNs
    position_radar_m: Vector3
    pixel_px: Vector2
    best_image_time: TimeNs

    def __post_init__(self) -> None:
        object.__setattr__(self, "position_radar_m", frozen_array(self.position_radar_m, (3,)))
        object.__setattr__(self, "pixel_px", frozen_array(self.pixel_px, (2,)))


def placements_of(stage: Stage) -> tuple[SimulatedPlacement, ...]:
    """Return the truth about every placement."""
    found: list[SimulatedPlacement] = []
    for resting in stage.story.restings:
        point = (stage.rig.radar_from_world @ resting.position_m[None])[0]
        pixel = stage.rig.camera.project(stage.rig.camera_from_radar @ point[None])[0]
        start, end = stage.recorded_span(resting.start_s, resting.end_s)
        best = _best_frame(stage, resting, [placement.best_image_time for placement in found])
        found.append(SimulatedPlacement(f"placement-{resting.index + 1:02d}", start, end, point, pixel, best))
    return tuple(found)


def _best_frame(stage: Stage, resting: Resting, taken: list[TimeNs]) -> TimeNs:
    """Find the frame nearest to the middle of a placement in which the whole reflector is visible.

    Raises:
        OptionError: no frame shows it; the frame rate is too low for the dwell.
    """
    for time in clear_frames(stage, resting):
        if time not in taken:
            return time
    raise OptionError(f"no frame shows placement {resting.index + 1}: raise the frame rate or the dwell time")


def clear_frames(stage: Stage, resting: Resting) -> Iterator[TimeNs]:
    """Yield the stamps of the frames in which nobody hides a placement, those nearest to the middle of its dwell first.

    Several reflectors are clicked when the last of them has been put down, before the first one is moved again.
    """
    restings, together = stage.story.restings, stage.options.reflectors
    last = restings[min(resting.index - resting.index % together + together, len(restings)) - 1]
    start_s, end_s = max(resting.start_s, last.start_s), min(resting.end_s, last.left_alone_s)
    moments = stage.frame_times.moment_s
    inside = np.flatnonzero((moments > start_s) & (moments < end_s))
    middle_s = 0.5 * (start_s + end_s)
    for i in inside[np.argsort(np.abs(moments[inside] - middle_s), kind="stable")].tolist():
        moment = stage.story.at(float(moments[i]))
        people = (moment.person, *moment.passers_by) if stage.options.person else moment.passers_by
        states = [actor.state for actor in moment.traffic]
        people = (*people, *(state for state in states if isinstance(state, PersonState)))
        vehicles = [state for state in states if isinstance(state, VehicleState)]
        eye_m, apex_m = stage.rig.camera_position_world_m, resting.position_m[None]
        if any(hidden_by(vehicle, eye_m, apex_m)[0] for vehicle in vehicles):
            continue
        if all(_shows(stage, person, resting.position_m) for person in people):
            yield TimeNs(int(stage.frame_times.header_ns[i]))


def _shows(stage: Stage, person: PersonState, position_m: Vector3) -> bool:
    """Return whether no limb is near the line of sight from the camera to the reflector."""
    eye = stage.rig.camera_position_world_m
    sight = np.linspace(0.02, 0.98, 60)[:, None] * (position_m - eye) + eye
    for limb in capsules(person):
        steps = np.linspace(0.0, 1.0, 4)[:, None] * (limb.end_m - limb.start_m) + limb.start_m
        gap = np.linalg.norm(sight[:, None] - steps[None], axis=2).min()
        if gap < max(limb.start_radius_m, limb.end_radius_m) + _CLEARANCE_M:
            return False
    return True
