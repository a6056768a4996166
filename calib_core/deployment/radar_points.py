"""The radar's returns as clouds: for viewers that cannot draw the recorded messages, and with the radar's errors taken out."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.radar import RadarErrors
from calib_core.recordings import Recording
from calib_core.recordings.containers.writing import CloudMessage
from calib_core.results import Calibration

POINTS_TOPIC = "/cocalib/radar_points"
CORRECTED_TOPIC = "/cocalib/radar_points_corrected"
_LAST_STAMP_NS = (2**31 - 1) * NS_PER_S
_NAMES = ("x", "y", "z", "intensity", "velocity")


@dataclass(frozen=True, slots=True, eq=False)
class CloudTopic:
    """A topic of returns.

    Attributes:
        topic: its name.
        log_time: when to write the message [ns].
        cloud: the message.
    """

    topic: str
    log_time: int
    cloud: CloudMessage


def has_corrections(calibration: Calibration) -> bool:
    """Return whether a calibration knows errors of the radar that no transform can take out."""
    return calibration.angle_map is not None or calibration.radar_errors != RadarErrors()


def clouds(
    recording: Recording, frame: str, *, as_reported: bool, correction: Calibration | None
) -> Iterator[CloudTopic]:
    """Read the returns, a bounded number at a time, in order of time.

    Args:
        recording: with a radar.
        frame: of the returns.
        as_reported: whether to give them as the radar reports them.
        correction: also gives them with this calibration's radar errors and angle map applied; None for no such clouds.
    """
    for scans in recording.radar_windows():
        for number in range(len(scans)):
            scan = scans.scan(number)
            there = np.isfinite(scan.points_radar_m).all(axis=1)
            points_radar_m, rest = scan.points_radar_m[there], (scan.snr_db[there], scan.doppler_mps[there])
            log_time = int(scan.time) + recording.radar_delay_ns
            if as_reported:
                yield CloudTopic(POINTS_TOPIC, log_time, _cloud(scan.time, frame, points_radar_m, *rest))
            if correction is not None:
                corrected_m = _corrected(correction, points_radar_m)
                yield CloudTopic(CORRECTED_TOPIC, log_time, _cloud(scan.time, frame, corrected_m, *rest))


def stampable(time: int) -> TimeNs:
    """Return a time as a stamp of ROS can hold it, from 1970 to 2038; damaged recordings have others."""
    return TimeNs(min(max(time, 0), _LAST_STAMP_NS))


def _corrected(calibration: Calibration, points_radar_m: Points3) -> Points3:
    if not len(points_radar_m):
        return points_radar_m
    corrected_m = calibration.radar_errors.corrected(points_radar_m)
    return corrected_m if calibration.angle_map is None else calibration.angle_map.corrected(corrected_m)


def _cloud(
    time: TimeNs, frame: str, points_radar_m: Points3, snr_db: np.ndarray, doppler_mps: np.ndarray
) -> CloudMessage:
    return CloudMessage(stampable(time), frame, _NAMES, np.column_stack([points_radar_m, snr_db, doppler_mps]))
