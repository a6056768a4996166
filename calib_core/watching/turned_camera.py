"""A camera that turned between the placements of one recording: found in the images that were clicked."""

from collections.abc import Mapping, Sequence

import numpy as np

from calib_core.camera import Camera
from calib_core.measurements import NS_PER_S, DataWarning, ReflectorClick, TimeNs
from calib_core.watching.witnesses import Turn

FEW_IMAGES, MOST_IMAGES = 5, 16
"""That are looked at first, and to say when if these show a turn."""
_LEAST_REGISTERED = 0.8  # of the images: where fewer register, the rig moves
_SIGMAS = 5.0
_SCATTER = 3.0
_FLOOR_RAD = np.deg2rad(0.01)
_MOST_RAD = np.deg2rad(5.0)


def camera_turned(
    turns: Mapping[TimeNs, Turn | None], clicks: Sequence[ReflectorClick], camera: Camera, *, sigma_px: float
) -> tuple[DataWarning, ...]:
    """Warn if the camera turned by more than a click is off by, with the placements on one side of it.

    Args:
        turns: of the images since the first of them; None for one that does not register with it.
        clicks: in these images or others.
        camera: the lens.
        sigma_px: standard deviation of a click.
    """
    known = {time: turn for time, turn in sorted(turns.items()) if turn is not None}
    if len(known) < 2 or len(known) < _LEAST_REGISTERED * len(turns):
        return ()
    times, found = [*known], [*known.values()]
    rotations = np.array([turn.rotation_rad for turn in found])
    sigmas = np.sqrt(np.array([np.diag(turn.covariance_rad2) for turn in found]))
    count = np.arange(1, len(times))
    sums = np.cumsum(rotations[:, :2], axis=0)
    apart = sums[:-1] / count[:, None] - (sums[-1] - sums[:-1]) / (len(times) - count)[:, None]
    split = 1 + int(np.argmax(count * (len(times) - count) * (apart**2).sum(axis=1)))
    step = np.median(rotations[split:], axis=0) - np.median(rotations[:split], axis=0)
    rest = np.concatenate([side - np.median(side, axis=0) for side in (rotations[:split], rotations[split:])])
    noise = np.maximum(np.median(sigmas, axis=0), 1.4826 * np.median(np.abs(rest), axis=0))
    size = float(np.linalg.norm(step[:2]))
    least = max(sigma_px / camera.matrix_px[0, 0], _SIGMAS * float(np.linalg.norm(noise[:2])), _SCATTER * _FLOOR_RAD)
    if not least < size < _MOST_RAD:
        return ()
    few_before = 2 * split <= len(times)
    named = [click.id for click in clicks if click.counts and (click.image_time < times[split]) == few_before]
    start = min(times)
    facts = {
        "turned_deg": float(np.rad2deg(size)),
        "last_s": (times[split - 1] - start) / NS_PER_S,
        "first_s": (times[split] - start) / NS_PER_S,
        "ids": tuple(named),
        "before": few_before,
    }
    return (DataWarning("camera-turned", facts),)
