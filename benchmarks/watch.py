"""How soon traffic shows that a camera turned, and how often it says so when nothing did.

python -m benchmarks.watch [--seed 1001] [--seconds 180] [--kinds people/awr1843 ...]

Each kind of traffic is simulated once, with a baseline of ten minutes and boxes as a detector would draw them: edges off by 1 px
and 2 % in each frame and by 2 % for a whole track, one box in twenty missed, no tracks. Turns are planted in what follows by
moving each row by what the turn does to it. Recordings have one seed each, counted up from --seed.
"""

import argparse
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import NS_PER_S, Box, Boxes, FrameBoxes, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.synthetic.annotations import true_boxes
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.watching.traffic import TrafficModel, TrafficRows, Watched, learned
from calib_core.watching.watching import stretches

__all__ = ["main"]

_KINDS = ("people/awr1843", "people/imaging", "cars-near/imaging", "robot/imaging")
_BASELINE_S = 600
_WINDOWS_S = (6, 12, 24, 48)
_SIGMAS = 5.0
_TURNS = (("pitch", 0, 0.5), ("pitch", 0, 1.0), ("yaw", 1, 0.5), ("yaw", 1, 1.0), ("roll", 2, 2.0))


class _Radar:
    """A simulated recording without its images."""

    def __init__(self, recording: SimulatedRecording) -> None:
        self.name = "simulated"
        self.scans = recording.scans
        self.radar_times: TimesNs = self.scans.times_ns
        self.image_times: TimesNs = self.scans.times_ns[:0]

    def image(self, index: int) -> np.ndarray:
        """Return no image: there are none."""
        raise IndexError(index)

    def radar_scans(self, start: TimeNs | None = None, end: TimeNs | None = None) -> RadarScans:
        """Return the scans between two times."""
        assert start is not None
        assert end is not None
        return self.scans.between(start, end)


def _detected(boxes: Boxes, rng: np.random.Generator, size_px: tuple[int, int]) -> Boxes:
    """Return boxes as a detector draws them."""
    of_track: dict[str, np.ndarray] = {}
    most = np.array([*size_px, *size_px]) - 0.5
    frames = []
    for frame in boxes:
        drawn = []
        for box in frame.boxes:
            edges = np.array([box.left_px, box.top_px, box.right_px, box.bottom_px])
            share = of_track.setdefault(box.track, 0.02 * rng.normal(size=4)) + 0.02 * rng.normal(size=4)
            off = share * np.tile(edges[2:] - edges[:2], 2) + rng.normal(size=4)
            at_border = (edges < 0.1) | (edges > most - 0.6)
            edges = np.where(at_border, edges, np.clip(edges + off, -0.5, most))
            if rng.uniform() > 0.05 and (edges[2:] - edges[:2] >= 3.0).all():
                drawn.append(Box(*edges.tolist(), label=box.label))
        frames.append(FrameBoxes(frame.image_time, tuple(drawn)))
    return Boxes(tuple(frames), "simulated", boxes.image_size_px)


def _rows(kind: str, seed: int, seconds: int) -> tuple[TrafficRows, TrafficRows]:
    """Return the rows of the baseline and those after it."""
    preset, _, radar = kind.partition("/")
    options = PRESETS[preset]
    traffic = replace(options.traffic, duration_s=float(_BASELINE_S + seconds))
    recording = simulate(replace(options, radar=radar, seed=seed, traffic=traffic))
    camera = recording.camera
    boxes = _detected(true_boxes(recording), np.random.default_rng([seed, 5]), (camera.width_px, camera.height_px))
    watched = Watched(recording.camera_from_radar, camera, RadarErrors())
    found = [one.rows for one in stretches(_Radar(recording), watched, boxes) if one.rows is not None]
    rows = TrafficRows.joined(found)
    end = rows.times_ns.min() + _BASELINE_S * NS_PER_S
    return rows.some(rows.times_ns < end), rows.some(rows.times_ns >= end)


def _seen_after(model: TrafficModel, rows: TrafficRows, axis: int, turn_deg: float) -> float:
    """Return after how many seconds a turn about an axis is seen; infinity for never."""
    turned = replace(rows, residuals_rad=rows.residuals_rad + rows.design[:, axis] * np.deg2rad(turn_deg))
    start = int(rows.times_ns.min())
    for end in range(2, int((rows.times_ns.max() - start) / NS_PER_S) + 1, 2):
        for window in _WINDOWS_S:
            within = (turned.times_ns >= start + max(end - window, 0) * NS_PER_S) & (
                turned.times_ns < start + end * NS_PER_S
            )
            turn = model.turn(turned.some(within)) if within.any() else None
            if turn is not None and (turn.least_z[axis] if turn_deg else turn.least_z.max()) > _SIGMAS:
                return float(end)
    return float("inf")


def _measured(kind: str, seed: int, seconds: int) -> tuple[str, list[float]]:
    """Return a line about a recording, and after how many seconds no turn and each of the turns is seen."""
    before, after = _rows(kind, seed, seconds)
    model = learned(before)
    times = [_seen_after(model, after, 0, 0.0), *(_seen_after(model, after, axis, size) for _, axis, size in _TURNS)]
    whole = model.turn(after)
    assert whole is not None
    off, sigma = np.rad2deg(whole.rotation_rad), np.rad2deg(np.sqrt(np.diag(whole.covariance_rad2)))
    cells = [f"{name} {one:+.2f} ± {s:.2f}" for name, one, s in zip(("pitch", "yaw", "roll"), off, sigma, strict=True)]
    return f"{kind}, seed {seed}: {sum(model.passages)} passages; nothing turned: {', '.join(cells)} deg", times


def _report(seed: int, seconds: int, kinds: tuple[str, ...]) -> Iterator[str]:
    every = []
    with ProcessPoolExecutor(2) as pool:
        seeds = range(seed, seed + len(kinds))
        for line, times in pool.map(_measured, kinds, seeds, [seconds] * len(kinds)):
            every.append(times)
            yield line
    alarms, *found = np.array(every).T
    yield f"nothing turned: {np.isfinite(alarms).sum()} alarms in {len(kinds) * seconds / 3600.0:.2f} h"
    for (name, _, size), times in zip(_TURNS, found, strict=True):
        yield f"{size:g} deg of {name}: seen in {np.isfinite(times).sum()} of {len(times)}, median {np.median(times):.0f} s"


def main() -> int:
    """Print the report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1001)
    parser.add_argument("--seconds", type=int, default=180)
    parser.add_argument("--kinds", nargs="+", default=_KINDS)
    given = parser.parse_args()
    for line in _report(given.seed, given.seconds, tuple(given.kinds)):
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
