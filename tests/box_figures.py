"""Acc of a pose on a recording in one call: the steps that the application takes one by one."""

from collections.abc import Sequence

from calib_core.camera import Camera
from calib_core.evaluation.box_acc import judged_by_boxes
from calib_core.evaluation.counted_returns import counted_returns
from calib_core.evaluation.figures import BoxFigures
from calib_core.evaluation.moving_returns import TargetOptions
from calib_core.evaluation.target_tracking import TargetTrack, find_targets
from calib_core.geometry import RigidTransform
from calib_core.measurements import Boxes, RadarScans, ReturnLabels
from calib_core.radar import RadarErrors


def box_figures(
    camera_from_radar: RigidTransform,
    camera: Camera,
    scans: RadarScans,
    boxes: Boxes,
    *,
    labels: ReturnLabels | None = None,
    targets: Sequence[TargetTrack] | None = None,
    radar_errors: RadarErrors | None = None,
    classes: Sequence[str] = (),
    max_gap_s: float | None = None,
    options: TargetOptions | None = None,
) -> BoxFigures:
    """Compute Acc of a pose on a recording, with what stands behind it.

    Args:
        camera_from_radar: the pose that is judged.
        camera: the lens.
        scans: of the recording.
        boxes: of its frames.
        labels: the true origin of each return, which then decides instead of the radar's own targets.
        targets: what `find_targets` found; None searches the scans.
        radar_errors: of the radar, taken out before the projection.
        classes: count only targets of these classes; all if empty.
        max_gap_s: longest time between a frame and its scan; None takes half the period of the scans.
        options: of the search for targets.

    Raises:
        InputError: the boxes are of another recording, or no class matches.
    """
    if labels is None and targets is None:
        targets = find_targets([scans], options).tracks
    found = labels if labels is not None else targets or ()
    counted = counted_returns(camera, scans, boxes, found, classes=classes, max_gap_s=max_gap_s)
    return judged_by_boxes(camera_from_radar, camera, counted, radar_errors=radar_errors)
