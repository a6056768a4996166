"""How long a recording of half an hour takes: 20 scans and 30 images of 1920 x 1080 a second."""

import os
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.intrinsics.tables import Table
from benchmarks.proposing.cases import Case
from benchmarks.proposing.drawn import Drawn, draw
from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, RadarScans, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import ViewProgress
from calib_core.synthetic.options import SimulationOptions, Surroundings
from cocalib.proposing import find_proposals

__all__ = ["speed_table"]

_RATE_HZ = 30.0
_PLACEMENTS = 60
_DWELL_S = 26.5
_WINDOW = 200
_OPTIONS = SimulationOptions(
    scene="field",
    placements=_PLACEMENTS,
    dwell_s=_DWELL_S,
    radar_rate_hz=20.0,
    camera_rate_hz=0.2,
    width_px=1920,
    height_px=1080,
    surroundings=Surroundings(passers_by=4),
)


@dataclass(slots=True)
class _Filmed:
    """A recording with 30 images a second, each the JPEG of the simulated frame nearest in time; it counts those decoded.

    Attributes:
        image_times: stamps of the frames.
        nearest: (n,) the simulated frame of each.
        scans: of the radar.
        jpegs: of the simulated frames.
        decoded: numbers of the frames that were decoded, in order.
    """

    image_times: TimesNs
    nearest: np.ndarray
    scans: RadarScans
    jpegs: tuple[bytes, ...]
    decoded: list[int] = field(default_factory=list)
    lock: threading.Lock = field(default_factory=threading.Lock)

    def image(self, index: int, /) -> np.ndarray:
        """Decode a frame: uint8 (h, w, 3), blue first."""
        with self.lock:
            self.decoded.append(index)
        data = np.frombuffer(self.jpegs[int(self.nearest[index])], dtype=np.uint8)
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))

    def radar_windows(self) -> Iterator[RadarScans]:
        """Yield all scans in order of time, ten seconds at once."""
        scans = self.scans
        for first in range(0, len(scans), _WINDOW):
            last = min(first + _WINDOW, len(scans))
            rows = slice(int(scans.first_return[first]), int(scans.first_return[last]))
            yield RadarScans(
                scans.times_ns[first:last],
                scans.first_return[first : last + 1] - scans.first_return[first],
                scans.points_radar_m[rows],
                scans.doppler_mps[rows],
                scans.snr_db[rows],
                scans.sigma_polar[rows],
            )


def speed_table(first: int, frames: Path) -> Table:
    """Measure one long recording, from its scans and compressed images to proposals.

    Args:
        first: its seed.
        frames: where rendered frames are kept.
    """
    case = Case(replace(_OPTIONS, seed=first))
    drawn = draw(case, frames / "long")
    filmed = _filmed(drawn, frames / "long" / case.name)
    load, began_s, worked_s = os.getloadavg()[0], time.perf_counter(), time.process_time()
    seen_s: list[float] = []

    def note(progress: ViewProgress | str) -> None:
        if isinstance(progress, ViewProgress) and any(view.candidates for view in progress.views):
            seen_s.append(time.perf_counter() - began_s)

    found = find_proposals(filmed, drawn.recording.camera, CalibrationOptions(), progress=note)
    took_s, worked_s = time.perf_counter() - began_s, time.process_time() - worked_s
    proposed = 0 if isinstance(found, Unsolvable) else len(found[1].ranked)
    length_min = float(filmed.image_times[-1] - filmed.image_times[0]) / NS_PER_S / 60.0
    row = (
        f"{length_min:.0f} min, {len(drawn.scans):,} scans, {len(filmed.image_times):,} frames",
        f"{len(drawn.placements)} of {_PLACEMENTS}, {proposed} proposed",
        f"{len(filmed.decoded)}, {len(set(filmed.decoded))} different",
        f"{seen_s[0]:.1f}" if seen_s else "-",
        f"{took_s:.1f}",
        f"{worked_s:.1f}",
        f"{os.cpu_count()}, {load:.1f}",
    )
    head = (
        "recording",
        "placements",
        "frames decoded",
        "first results after [s]",
        "all after [s]",
        "processor time [s]",
        "processors, load before",
    )
    return Table("Speed", head, (row,), _NOTE)


_NOTE = """Images of 1920 x 1080 repeat: a frame is the JPEG of the nearest of those rendered every five seconds, decoded each
time it is asked for; reading from a file is not part of it. First results: the first dwell with candidates is reported. The
aims: all in a minute on two processors that have nothing else to do, first results after five seconds, and only the frames
decoded that are needed."""


def _filmed(drawn: Drawn, folder: Path) -> _Filmed:
    simulated = drawn.frames.image_times
    step_ns = NS_PER_S / _RATE_HZ
    count = int((simulated[-1] - simulated[0]) / step_ns)
    image_times = np.asarray(simulated[0] + (np.arange(count) * step_ns).astype(np.int64))
    later = np.clip(np.searchsorted(simulated, image_times), 1, len(simulated) - 1)
    nearest = np.where(image_times - simulated[later - 1] < simulated[later] - image_times, later - 1, later)
    needed = {int(nearest[i]) for one in drawn.placements for i in _within(image_times, one.start, one.end)}
    for index in sorted(needed):
        if not (folder / f"{index}.jpg").is_file():
            drawn.frames.image(index)
    jpegs = tuple((folder / f"{index}.jpg").read_bytes() if index in needed else b"" for index in range(len(simulated)))
    return _Filmed(image_times, nearest, drawn.scans, jpegs)


def _within(times: TimesNs, start: int, end: int) -> range:
    return range(int(np.searchsorted(times, start)), int(np.searchsorted(times, end)))
