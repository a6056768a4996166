"""What watching costs: processor time over the recording's time, and memory, of a rendered recording that is looped.

Half a minute of people at 960 x 540 pixels and 10 Hz is rendered and kept as JPEG in memory; each loop is decoded and read as
the next half minute. Boxes are found in the images, which costs most, or are the simulation's.
"""

import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, Boxes, FrameBoxes, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.synthetic.annotations import true_boxes
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.watching.traffic import Watched
from calib_core.watching.watching import Watch, baseline_of, stretches

__all__ = ["report"]

_LOOP_S = 30
_LOOPS_AN_HOUR = 3600 / _LOOP_S
_KEPT_LOOPS = 21  # after which ten minutes of traffic are kept, and no more
_BASELINE_LOOPS = 4
_MB = 1e6


class _Looped:
    """A recording of some seconds that is seen again and again."""

    def __init__(self, recording: SimulatedRecording, loops: int) -> None:
        self.name = "looped"
        stage = recording.stage
        rng = np.random.default_rng(1)
        self._jpeg = [
            cv2.imencode(".jpg", recording.image(index, rng), [cv2.IMWRITE_JPEG_QUALITY, 85])[1]
            for index in range(len(stage.frame_times.header_ns))
        ]
        self._scans = recording.scans
        self._period_ns = _LOOP_S * NS_PER_S
        self._start = int(min(stage.frame_times.header_ns[0], self._scans.times_ns[0]))
        self.image_times = self._times(np.asarray(stage.frame_times.header_ns), loops)
        self.radar_times = self._times(self._scans.times_ns, loops)

    def _times(self, times_ns: TimesNs, loops: int) -> TimesNs:
        return np.concatenate([times_ns + loop * self._period_ns for loop in range(loops)])

    def image(self, index: int) -> np.ndarray:
        """Decode a frame."""
        return np.asarray(cv2.imdecode(self._jpeg[index % len(self._jpeg)], cv2.IMREAD_COLOR))

    def radar_scans(self, start: TimeNs | None = None, end: TimeNs | None = None) -> RadarScans:
        """Return scans; those of the loops around a time come from the same ones."""
        assert start is not None
        assert end is not None
        loops = range(max((start - self._start) // self._period_ns, 0), (end - self._start) // self._period_ns + 1)
        every = [replace(self._scans, times_ns=self._scans.times_ns + loop * self._period_ns) for loop in loops]
        return RadarScans.joined(every).between(start, end)


def report(seed: int, loops: int) -> Iterator[str]:
    """Yield what watching costs, and how its memory grows.

    Args:
        seed: of the recording.
        loops: of half a minute.
    """
    people = PRESETS["people"]
    options = replace(people, radar="imaging", seed=seed, width_px=960, height_px=540, camera_rate_hz=10.0)
    recording = simulate(replace(options, traffic=replace(people.traffic, duration_s=float(_LOOP_S))))
    looped = _Looped(recording, loops)
    watched = Watched(recording.camera_from_radar, recording.camera, RadarErrors())
    boxes = true_boxes(recording)
    every = [
        FrameBoxes(TimeNs(int(looped.image_times[index])), boxes.frames[index % len(boxes.frames)].boxes)
        for index in range(len(looped.image_times))
    ]
    for name, given, moving in (
        ("boxes given", Boxes(tuple(every), "simulated", boxes.image_size_px), False),
        ("boxes found (moving)", None, True),
    ):
        found = stretches(looped, watched, given, moving=moving)
        first = [next(found) for _ in range(_BASELINE_LOOPS)]
        watch = Watch(
            baseline_of(first, calibration_sha256="0" * 64, recording="looped", camera=watched.camera), watched
        )
        del first
        sizes, begin, count = [], time.process_time(), 0
        for stretch in found:
            watch.add(stretch)
            sizes.append(_resident_mb())
            count += 1
        cost = (time.process_time() - begin) / (count * _LOOP_S)
        after = sizes[min(_KEPT_LOOPS, count - 1) :]
        memory = f"memory {after[0]:.0f} MB, {len(after) / _LOOPS_AN_HOUR:.1f} h later {after[-1]:.0f} MB"
        yield f"{name}: {cost:.3f} of the recording's time; {memory}"


def _resident_mb() -> float:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / _MB
