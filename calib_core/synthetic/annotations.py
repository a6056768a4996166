"""The true boxes of a simulated recording, and the true origin of its returns; computed from the scene, not from images."""

import numpy as np

from calib_core.arrays import Points2, Points3, Vector2, Vector3
from calib_core.measurements import Box, Boxes, FrameBoxes, LabelledScan, ReturnLabels, TimeNs
from calib_core.synthetic.recording import SimulatedRecording
from calib_core.synthetic.rendering.surfaces import Solid, block
from calib_core.synthetic.scans import labelled_scans
from calib_core.synthetic.scene.person import PersonState, body_hides, capsules
from calib_core.synthetic.scene.stage import Stage
from calib_core.synthetic.scene.traffic import Actor, VehicleState, hidden_by, outline_points

_LEAST_VISIBLE = 0.25
"""Least share of an object that must be visible for a box."""
_LEAST_PX = 3.0
_ASKED = 80
"""Of how many points of an outline it is asked whether anything hides them."""
_TURNS_RAD = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
_SHOULDER_M = 0.22
_HEAD_M = 1.85
_PX_DECIMALS = 2
"""The last bits of a projection depend on the order of its sums; the file must not."""


def is_annotated(recording: SimulatedRecording) -> bool:
    """Return whether anything moves in a recording that is worth judging: traffic or passers-by."""
    story = recording.stage.story
    return bool(story.movers or story.passers_by)


def true_boxes(recording: SimulatedRecording) -> Boxes:
    """Compute the box of everything that moves, in each frame.

    A box goes around the whole silhouette, as seen through the true lens, and ends at the image's border. Its score is the
    share of the object that nothing hides and that is in the image; objects below a quarter have no box.
    """
    stage = recording.stage
    solids = [block(item) for item in stage.scene.solids]
    frames = []
    for moment_s, stamp in zip(stage.frame_times.moment_s, stage.frame_times.header_ns, strict=True):
        people = stage.story.people_at(float(moment_s), person=stage.options.person)
        actors = (*people, *stage.story.at(float(moment_s)).traffic)
        boxes = [_box(stage, actor, actors, solids) for actor in actors]
        frames.append(FrameBoxes(TimeNs(int(stamp)), tuple(box for box in boxes if box is not None)))
    camera = recording.camera
    return Boxes(tuple(frames), "the simulation", (camera.width_px, camera.height_px))


def true_labels(recording: SimulatedRecording) -> ReturnLabels:
    """List the track of every return of every scan of the radar's only antenna, in the order in which they are sent."""
    stage = recording.stage
    scans = (
        LabelledScan(scan.time, tracks) for antenna in stage.antennas for scan, tracks in labelled_scans(stage, antenna)
    )
    return ReturnLabels(tuple(sorted(scans, key=lambda scan: scan.radar_time)), "the simulation")


def _box(stage: Stage, actor: Actor, actors: tuple[Actor, ...], solids: list[Solid]) -> Box | None:
    """Return an object's box; None if it is not in the image or mostly hidden."""
    camera, eye_m = stage.rig.camera, stage.rig.camera_position_world_m
    outline_m = _silhouette(actor.state, eye_m)
    in_camera = stage.rig.camera_from_world @ outline_m
    pixels = camera.project(in_camera)
    seen = np.isfinite(pixels).all(axis=1) & (in_camera[:, 2] > 0.1)
    if not seen.any():
        return None
    low, high = pixels[seen].min(axis=0), pixels[seen].max(axis=0)
    border = np.array([camera.width_px, camera.height_px]) - 0.5
    clipped_low, clipped_high = np.clip(low, -0.5, border), np.clip(high, -0.5, border)
    if np.any(clipped_high - clipped_low < _LEAST_PX):
        return None
    some = np.linspace(0, len(pixels) - 1, min(_ASKED, len(pixels))).astype(np.int64)
    visible = seen[some] & camera.in_image(pixels[some])
    others = [other.state for other in actors if other.track != actor.track]
    visible[visible] = ~_hidden(eye_m, outline_m[some][visible], others, solids)
    share = float(visible.mean())
    if share < _LEAST_VISIBLE:
        return None
    (left, top), (right, bottom) = clipped_low.round(_PX_DECIMALS).tolist(), clipped_high.round(_PX_DECIMALS).tolist()
    return Box(left, top, right, bottom, actor.label, round(share, 2), actor.track)


def _silhouette(state: PersonState | VehicleState, eye_m: Vector3) -> Points3:
    """Return points (n, 3) on an object's outline as seen from an eye; their pixels bound it."""
    if isinstance(state, VehicleState):
        return outline_points(state)
    limbs = capsules(state)
    centres = np.array([end for limb in limbs for end in (limb.start_m, limb.end_m)])
    radii = np.array([radius for limb in limbs for radius in (limb.start_radius_m, limb.end_radius_m)])
    sight = centres - eye_m
    sight /= np.linalg.norm(sight, axis=1, keepdims=True)
    across = np.cross(sight, [0.0, 0.0, 1.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    upward = np.cross(across, sight)
    circle = np.cos(_TURNS_RAD)[None, :, None] * across[:, None] + np.sin(_TURNS_RAD)[None, :, None] * upward[:, None]
    return np.asarray((centres[:, None] + radii[:, None, None] * circle).reshape(-1, 3))


def _hidden(
    eye_m: Vector3, points_m: Points3, others: list[PersonState | VehicleState], solids: list[Solid]
) -> np.ndarray:
    """Return which points (n, 3) other objects or the scene's solids hide from an eye."""
    hidden = np.zeros(len(points_m), dtype=np.bool_)
    for other in others:
        if isinstance(other, VehicleState):
            hidden |= hidden_by(other, eye_m, points_m)
        else:
            hidden |= body_hides(other, eye_m, points_m, half_width_m=_SHOULDER_M, clearance_m=0.4, height_m=_HEAD_M)
    way = points_m - eye_m
    distance = np.linalg.norm(way, axis=1)
    origin, rays = eye_m.astype(np.float32), (way / distance[:, None]).astype(np.float32)
    for solid in _between(eye_m[:2], points_m[:, :2], solids):
        hidden |= solid.crossing(origin, rays)[0] < distance - 0.05
    return hidden


def _between(eye_m: Vector2, points_m: Points2, solids: list[Solid]) -> list[Solid]:
    """Return the solids that may be between an eye and points (n, 2), as seen from above: a few of many."""
    if not len(points_m):
        return []
    low, high = (
        np.array([side[:2] for side in sides]) for sides in zip(*((s.low_m, s.high_m) for s in solids), strict=True)
    )
    end = points_m.mean(axis=0) - eye_m
    to_middle = 0.5 * (low + high) - eye_m
    share = np.clip(to_middle @ end / max(end @ end, 1e-9), 0.0, 1.0)
    apart_m = np.linalg.norm(to_middle - share[:, None] * end, axis=1)
    reach_m = 0.5 * np.linalg.norm(high - low, axis=1) + np.linalg.norm(points_m - eye_m - end, axis=1).max()
    return [solids[i] for i in np.flatnonzero(apart_m <= reach_m + 0.01)]
