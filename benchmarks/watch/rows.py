"""Simulated traffic without its images, as rows that a watch compares; kept on disk, so that a long run can be resumed."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np

from calib_core.arrays import TimesNs
from calib_core.measurements import Box, Boxes, FrameBoxes, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.synthetic.annotations import true_boxes
from calib_core.synthetic.presets import PRESETS
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.watching.traffic import TrafficRows, Watched
from calib_core.watching.watching import stretches

__all__ = ["simulated_rows"]

_WIDTH_PX = 960  # of rendered images


class _Recording:
    """A simulated recording, with its images or without."""

    def __init__(self, recording: SimulatedRecording, *, rendered: bool) -> None:
        self.name = "simulated"
        self.scans = recording.scans
        self.radar_times: TimesNs = self.scans.times_ns
        self.image_times: TimesNs = np.asarray(recording.stage.frame_times.header_ns)[: None if rendered else 0]
        self._recording = recording

    def image(self, index: int) -> np.ndarray:
        """Render an image."""
        return self._recording.image(index, np.random.default_rng(index))

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


def simulated_rows(kind: str, seed: int, seconds: int, folder: Path | None, *, rendered: bool = False) -> TrafficRows:
    """Return the rows of a recording; those in the folder are read.

    Args:
        kind: a preset and a radar, such as people/imaging.
        seed: of everything.
        seconds: of traffic.
        folder: where rows are kept.
        rendered: find the boxes in rendered images, in place of drawing them around what is simulated.
    """
    name = f"{kind.replace('/', '-')}-{seed}-{seconds}{'-rendered' if rendered else ''}.npz"
    path = None if folder is None else folder / name
    if path is not None and path.exists():
        with np.load(path) as kept:
            return TrafficRows(
                **{name: values.astype(object) if name == "labels" else values for name, values in kept.items()}
            )
    preset, _, radar = kind.partition("/")
    options = PRESETS[preset]
    traffic = replace(options.traffic, duration_s=float(seconds))
    size = {"width_px": _WIDTH_PX, "height_px": _WIDTH_PX * 9 // 16} if rendered else {}
    recording = simulate(replace(options, radar=radar, seed=seed, traffic=traffic, **size))
    camera = recording.camera
    boxes = None
    if not rendered:
        boxes = _detected(true_boxes(recording), np.random.default_rng([seed, 5]), (camera.width_px, camera.height_px))
    watched = Watched(recording.camera_from_radar, camera, RadarErrors())
    given = _Recording(recording, rendered=rendered)
    found = [one.rows for one in stretches(given, watched, boxes, moving=rendered) if one.rows is not None]
    rows = TrafficRows.joined(found)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_suffix(".part.npz")
        np.savez(
            part,
            **{field.name: getattr(rows, field.name) for field in fields(rows)} | {"labels": rows.labels.astype(str)},
        )
        part.replace(path)
    return rows
