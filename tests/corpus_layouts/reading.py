"""Open a layout as a user does and compare what was read with its truth."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from calib_core.errors import CalibrationError
from calib_core.recordings import Recording, RecordingOptions, open_recording
from tests.corpus_layouts.truth import CAMERA, Returns, Truth, grey_of_frame

Outcome = Literal["right", "right as assumed", "differs as assumed", "refused", "wrong"]


@dataclass(frozen=True)
class Reading:
    """How a layout was read.

    Attributes:
        outcome: "differs as assumed" if what differs from the truth is what the recording states as an assumption.
        why: the differences, the assumptions or the refusal.
    """

    outcome: Outcome
    why: str


def read(truth: Truth, options: RecordingOptions | None = None) -> Reading:
    """Open a layout without further options than it needs, or with those that a user adds."""
    try:
        with open_recording(list(truth.paths), truth.given if options is None else options) as recording:
            differences = _differences(recording, truth)
            keys = sorted({f"{item.key} of {item.topic}" for item in recording.assumptions})
            if differences and keys and not _differences(recording, _as_assumed(truth)):
                return Reading("differs as assumed", ", ".join(keys))
    except CalibrationError as error:
        return Reading("refused", str(error))
    if differences:
        return Reading("wrong", "; ".join(differences) + (f" (assumed: {', '.join(keys)})" if keys else ""))
    return Reading("right as assumed", ", ".join(keys)) if keys else Reading("right", "")


def _as_assumed(truth: Truth) -> Truth:
    """Return the truth under the other assumption that the layout leaves open, if it does."""
    points_m = truth.returns.points_m if truth.as_assumed_m is None else truth.as_assumed_m
    return replace(truth, returns=truth.returns.with_points(points_m))


def _differences(recording: Recording, truth: Truth) -> list[str]:
    """Say in what a recording differs from its truth."""
    return [
        *_frame_differences(recording, truth),
        *_radar_differences(recording, truth),
        *_camera_differences(recording, truth),
    ]


def _frame_differences(recording: Recording, truth: Truth) -> list[str]:
    times_ns = recording.image_times
    if len(times_ns) != len(truth.image_times_ns):
        return [f"{len(times_ns)} frames instead of {len(truth.image_times_ns)}"]
    found = []
    late_ns = np.abs(times_ns - truth.image_times_ns).max()
    if not truth.times_are_relative and late_ns > truth.time_tolerance_ns:
        found.append(f"frames are up to {late_ns / 1e9:g} s off")
    greys = np.array([recording.image(number).mean() for number in range(len(times_ns))])
    expected = np.array([grey_of_frame(number * truth.frame_step) for number in range(len(times_ns))])
    if np.abs(greys - expected).max() > 1.5:
        found.append(f"{int((np.abs(greys - expected) > 1.5).sum())} frames are other images")
    return found


def _radar_differences(recording: Recording, truth: Truth) -> list[str]:
    scans = recording.radar_scans()
    counts = np.diff(scans.first_return)
    times_ns = np.repeat(scans.times_ns, counts)
    if len(times_ns) != len(truth.returns.times_ns):
        return [f"{len(times_ns)} returns in {len(scans.times_ns)} scans instead of {len(truth.returns.times_ns)}"]
    own = Returns(times_ns, scans.points_radar_m, scans.doppler_mps, scans.snr_db)
    expected = truth.returns
    if truth.times_are_relative:
        own, expected = (
            _with_frame_numbers(own, recording.image_times),
            _with_frame_numbers(expected, truth.image_times_ns),
        )
    order = np.argsort(own.times_ns, kind="stable")
    own, times_ns = own.where(order), np.unique(expected.times_ns)
    return _scan_differences(own, expected, truth, times_ns)


def _scan_differences(own: Returns, expected: Returns, truth: Truth, times_ns: np.ndarray) -> list[str]:
    """Compare scan by scan; each return belongs to the nearest one of the truth, and no two to the same."""
    late_ns = np.abs(np.sort(own.times_ns) - np.sort(expected.times_ns)).max()
    if late_ns > truth.time_tolerance_ns:
        return [f"scans are up to {late_ns / 1e9:g} s off"]
    off_m, off_mps = 0.0, 0.0
    for time_ns in times_ns.tolist():
        scan = own.where(np.abs(own.times_ns - time_ns) <= truth.time_tolerance_ns)
        true = expected.of_time(time_ns)
        distances_m = np.linalg.norm(scan.points_m[:, None] - true.points_m[None], axis=2)
        nearest = distances_m.argmin(axis=1)
        if len(np.unique(nearest)) != len(true.times_ns):
            return ["returns of other scans or other positions"]
        off_m = max(off_m, float(distances_m.min(axis=1).max()))
        off_mps = max(off_mps, float(np.abs(scan.doppler_mps - true.doppler_mps[nearest]).max()))
    found = [f"positions are up to {off_m:.3g} m off"] if not off_m <= truth.position_tolerance_m else []
    if truth.has_doppler and not off_mps <= 0.03:
        found.append(f"speeds are up to {off_mps:.3g} m/s off")
    return found


def _with_frame_numbers(returns: Returns, image_times_ns: np.ndarray) -> Returns:
    return returns.with_times(np.searchsorted(image_times_ns, returns.times_ns, side="right"))


def _camera_differences(recording: Recording, truth: Truth) -> list[str]:
    camera = recording.camera()
    if camera is None:
        return ["no camera"] if truth.has_camera else []
    if not truth.has_camera:
        return ["a camera that is not stated"]
    return [] if np.allclose(camera.matrix_px, CAMERA, atol=1e-3) else [f"another camera: {camera.matrix_px.tolist()}"]
