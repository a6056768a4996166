"""Figs. 2 to 6 as SVG: rendered frames with what is clicked and projected, and histograms of Acc; all simulated."""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np

from benchmarks.paper.judgement import CHOSEN_ROW
from benchmarks.paper.moving import MOVING, judged_by_both, recording_of
from benchmarks.paper.page import Measured
from benchmarks.paper.rows import (
    by_checkerboard,
    by_mounting,
    calibrated,
    figures_of,
    points_and_pixels,
    projected_by,
    with_gross_errors,
)
from benchmarks.paper.settings import SEED_SETS, Dataset, Settings, options_of, other_rig
from benchmarks.proposing.images import SimulatedImages
from calib_core.arrays import Flags, Indices, Points2
from calib_core.evaluation.figures import BoxFigures
from calib_core.geometry import RigidTransform
from calib_core.measurements import Box, TimeNs
from calib_core.results import Calibration
from calib_core.synthetic.annotations import true_boxes
from calib_core.synthetic.presets import PresetName
from calib_core.synthetic.recording import SimulatedRecording, simulate

_STYLE = (
    "<style>text{font:15px sans-serif;fill:#222}.title{font-size:18px;font-weight:bold}.axis{stroke:#444;fill:none}"
    ".grid{stroke:#ddd}.bar{fill:#0072b2}.middle{text-anchor:middle}.end{text-anchor:end}</style>"
)
_CLICK, _AT, _MISSED, _BOX = "#e8000b", "#1f6fff", "#ff8c00", "#ffe600"
_WIDTH, _GAP, _HEAD, _LINE = 620, 12, 34, 24
_HEIGHT = _WIDTH * 9 // 16
_FAR_M = 40.0
_WIDE_PX = 1000.0
"""Of wider views every other pixel is traced, which takes most of the time."""
View: TypeAlias = tuple[float, float, float, float]
"""The part of an image that is shown: left, top, width and height in its pixels."""


@dataclass(frozen=True, slots=True)
class Panel:
    """One image of a figure: its title, SVG in units of its own, and what of it is shown."""

    title: str
    inside: str
    view: View


def write_images(folder: Path, measured: Measured, settings: Settings) -> None:
    """Write fig-2.svg to fig-6.svg, each of the seed whose measured figures are nearest to the medians."""
    folder.mkdir(parents=True, exist_ok=True)
    clicked = "red: clicks, blue: projected radar positions"
    moving = "yellow: true boxes, blue: returns inside their own, orange: outside"
    d1, d2 = _typical_of(measured, "PPM+D1", "PMM+D1"), _typical_of(measured, "PPM+D2", "CCM+D2")
    d3 = _typical_of(measured, "PPM+D3", CHOSEN_ROW)
    seeds = {preset: _nearest_to_medians(_accs(measured, preset)) for preset in MOVING}
    figures = {
        "fig-2": (f"Fig. 2, simulated: D1, seed {d1} ({clicked})", _on_own_rig("d1", d1, settings)),
        "fig-3": (f"Fig. 3, simulated: D2, seed {d2} ({clicked})", _on_own_rig("d2", d2, settings)),
        "fig-4": (f"Fig. 4, simulated: D3, the aisle, seed {d3} ({clicked})", _d3(d3, settings)),
        "fig-5": (f"Fig. 5, simulated: (a) PPM, (b) PMM ({moving})", _real_world(seeds, settings)),
        "fig-6": ("Fig. 6, simulated: frames by their Acc, frames of 0 % included", _histograms(seeds, settings)),
    }
    for name, (title, panels) in figures.items():
        (folder / f"{name}.svg").write_text(_figure(title, panels), encoding="utf-8")


def _typical_of(measured: Measured, *names: str) -> int:
    """Return the seed nearest to the medians in AED and CDSD of some rows, and in how far off the other rig's pose is."""
    found = {}
    numbers = [seed for some, ours in zip(SEED_SETS, measured.sets, strict=True) for seed in some[: len(ours)]]
    for seed, one in zip(numbers, (*measured.sets[0], *measured.sets[1]), strict=True):
        rows = [one.rows[name] for name in names if name in one.rows]
        if len(rows) == len(names):
            poses = [g for g in one.gross if CHOSEN_ROW in names and g.figures == one.rows[CHOSEN_ROW]]
            values = [(row.aed_px, row.cdsd_px) for row in rows] + [(g.rotation_deg, g.position_m) for g in poses]
            found[seed] = np.log(values).ravel()
    return _nearest_to_medians(found)


def _accs(measured: Measured, preset: PresetName) -> dict[int, np.ndarray]:
    both = zip(SEED_SETS[0], measured.accs[preset], strict=False)
    return {seed: np.array([one.ppm, one.pmm]) for seed, one in both}


def _nearest_to_medians(values: Mapping[int, np.ndarray]) -> int:
    table = np.array(list(values.values()))
    return list(values)[int(np.abs(table - np.median(table, axis=0)).sum(axis=1).argmin())]


def _figure(title: str, panels: Sequence[Panel]) -> str:
    """Lay panels out in two columns."""
    width, row = 2 * _WIDTH + 3 * _GAP, _HEIGHT + _LINE + _GAP
    height = _HEAD + row * (len(panels) // 2)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}">',
        _STYLE,
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
        f'<text class="title" x="{_GAP}" y="24">{title}</text>',
    ]
    for number, panel in enumerate(panels):
        x, y = _GAP + (number % 2) * (_WIDTH + _GAP), _HEAD + (number // 2) * row
        left, top, wide, high = panel.view
        parts += [
            f'<text x="{x}" y="{y + 16}">{panel.title}</text>',
            f'<svg x="{x}" y="{y + _LINE}" width="{_WIDTH}" height="{_HEIGHT}" '
            f'viewBox="{left:.1f} {top:.1f} {wide:.1f} {high:.1f}">{panel.inside}</svg>',
        ]
    return "\n".join([*parts, "</svg>"]) + "\n"


def _on_own_rig(dataset: Dataset, seed: int, settings: Settings) -> list[Panel]:
    recording, ppm = _solved(dataset, seed, settings)
    other, pose = ("PMM", by_mounting(recording)) if dataset == "d1" else ("CCM", by_checkerboard(recording, ppm)[0])
    name = dataset.upper()
    return _clicked(recording, ppm, {f"(A) PPM+{name}": None, f"(B) {other}+{name}": pose})


def _d3(seed: int, settings: Settings) -> list[Panel]:
    recording, same = _solved("d3", seed, settings)
    other = other_rig(recording)
    apart = with_gross_errors(other, settings.gross_pairs, settings.gross_m).unwrap()
    wrong = f"{settings.gross_pairs} radar positions wrong by {settings.gross_m:g} m"
    return [
        *_clicked(recording, same, {"(A) same rig": None}),
        *_clicked(other, apart, {f"(B) other rig, {wrong}": None}),
    ]


def _solved(dataset: Dataset, seed: int, settings: Settings) -> tuple[SimulatedRecording, Calibration]:
    recording = simulate(options_of(dataset, seed, settings))
    return recording, calibrated(recording).unwrap()


def _clicked(
    recording: SimulatedRecording, ppm: Calibration, poses: Mapping[str, RigidTransform | np.ndarray | None]
) -> list[Panel]:
    """Draw the clicks of a calibration and where poses put their radar positions, on the frame of the first click."""
    _, pixels = points_and_pixels(ppm)
    view = _view_around(pixels, recording, least=0.3)
    back = _background(recording, recording.clicks[0].image_time, view)
    panels = []
    for title, pose in poses.items():
        at, figures = projected_by(pose, ppm), figures_of(ppm, pose)
        marks = [_line(a, b, view) for a, b in zip(pixels, at, strict=True)]
        marks += [_dot(a, _CLICK, view) for a in pixels] + [_dot(b, _AT, view) for b in at]
        said = f"{title}: AED {figures.aed_px:.1f}, CDSD {figures.cdsd_px:.1f} px"
        panels.append(Panel(said, back + "".join(marks), view))
    return panels


def _real_world(seeds: Mapping[PresetName, int], settings: Settings) -> list[Panel]:
    return [
        *_moving("people", "(A) people on the rooftop", seeds, settings),
        *_moving("robot", "(B) robot car in the aisle, seen from the other rig", seeds, settings),
        *_moving("cars-near", "(C) cars on the road", seeds, settings),
        *_moving("cars-far", f"(D) a far car, counted beyond {_FAR_M:g} m", seeds, settings, nearest_m=_FAR_M),
    ]


def _moving(
    preset: PresetName, title: str, seeds: Mapping[PresetName, int], settings: Settings, nearest_m: float = 0.0
) -> list[Panel]:
    """Draw a typical frame with returns at or beyond a range, by PPM and by PMM."""
    recording = recording_of(preset, seeds[preset], settings)
    both = judged_by_both(preset, seeds[preset], settings, labelled=True)
    found = [one.returns for one in both if one.returns is not None]
    far = np.linalg.norm(found[0].points_radar_m, axis=1) >= nearest_m
    boxed = np.isfinite(found[0].boxes_px).all(axis=1)
    number = _typical_frame(found[0].frames[far], [one.inside[far] for one in found])
    own = found[0].frames == number
    time = both[0].frames[number].image_time
    (shown,) = (frame for frame in true_boxes(recording) if frame.image_time == time)
    view = _view_around(found[0].boxes_px[own & far & boxed].reshape(-1, 2), recording, least=0.25)
    back = _background(recording, time, view)
    panels = []
    for letter, one in zip("ab", found, strict=True):
        inside, at = one.inside[own], one.pixels_px[own]
        marks = [_outline(box, view) for box in shown.boxes]
        marks += [_dot(a, _AT if good else _MISSED, view) for a, good in zip(at, inside, strict=True)]
        share = f"{int(one.inside[own & far].sum())} of {int((own & far).sum())} returns inside"
        name = f"{title[:2]}, {letter}{title[2:]}, seed {seeds[preset]}: {share}"
        panels.append(Panel(name, back + "".join(marks), view))
    return panels


def _typical_frame(frames: Indices, inside: Sequence[Flags]) -> int:
    """Return the frame whose shares of returns inside are nearest to Acc, of those with the median number of returns or more."""
    counts = np.bincount(frames)
    seen = counts > 0
    off = np.where(counts >= np.median(counts[seen]), 0.0, np.inf)
    for one in inside:
        share = np.bincount(frames, weights=one) / np.maximum(counts, 1)
        off += np.abs(share - share[seen].mean())
    return int(off.argmin())


def _histograms(seeds: Mapping[PresetName, int], settings: Settings) -> list[Panel]:
    panels = []
    names: Mapping[PresetName, str] = {"people": "people walking", "cars-far": "cars, 20 to 60 m"}
    for letters, (preset, name) in zip(("ab", "cd"), names.items(), strict=True):
        both = judged_by_both(preset, seeds[preset], settings)
        for letter, method, figures in zip(letters, ("PPM", "PMM"), both, strict=True):
            shown = f"{name}, seed {seeds[preset]}: Acc {100 * (figures.acc or 0.0):.0f} %"
            panels.append(_histogram(f"({letter}) {method}, {shown}", figures))
    return panels


def _histogram(title: str, figures: BoxFigures) -> Panel:
    shares = [frame.share for frame in figures.frames if frame.returns]
    counts = np.histogram(shares, np.linspace(0.0, 1.0, 11))[0] / max(len(shares), 1)
    left, low, tall, step = 70.0, _HEIGHT - 45.0, _HEIGHT - 70.0, (_WIDTH - 90.0) / 10.0
    parts = []
    for percent in (25, 50, 75, 100):
        y = low - tall * percent / 100.0
        parts.append(f'<path class="grid" d="M{left:.0f} {y:.0f}H{_WIDTH - 20}"/>')
        parts.append(f'<text class="end" x="{left - 6:.0f}" y="{y + 5:.0f}">{percent} %</text>')
    for number, count in enumerate(counts.tolist()):
        x = left + number * step
        parts.append(
            f'<rect class="bar" x="{x + 2:.1f}" y="{low - tall * count:.1f}" width="{step - 4:.1f}" height="{tall * count:.1f}"/>'
        )
    parts.append(f'<path class="axis" d="M{left:.0f} {low - tall:.0f}V{low:.0f}H{_WIDTH - 20}"/>')
    parts += [f'<text class="middle" x="{left + b * step:.0f}" y="{low + 18:.0f}">{10 * b}</text>' for b in range(11)]
    parts.append(f'<text class="middle" x="{_WIDTH / 2}" y="{low + 38:.0f}">Acc of a frame [%]</text>')
    parts.append(
        f'<text class="middle" transform="translate(14 {low - tall / 2:.0f}) rotate(-90)">share of the frames</text>'
    )
    return Panel(f"{title}, {len(shares)} frames", "".join(parts), (0.0, 0.0, float(_WIDTH), float(_HEIGHT)))


def _view_around(pixels_px: Points2, recording: SimulatedRecording, *, least: float) -> View:
    """Return the part of the image around some pixels: left, top, width, height; at least a share of its width."""
    camera = recording.camera
    low, high = pixels_px.min(axis=0), pixels_px.max(axis=0)
    shape = camera.width_px / camera.height_px
    wide = max(1.4 * (high[0] - low[0]), 1.4 * shape * (high[1] - low[1]), least * camera.width_px)
    wide = min(wide, float(camera.width_px))
    size = np.array([wide, wide / shape])
    corner = np.clip(0.5 * (low + high - size), 0.0, np.array([camera.width_px, camera.height_px]) - size)
    return float(corner[0]), float(corner[1]), float(size[0]), float(size[1])


def _background(recording: SimulatedRecording, time: TimeNs, view: View) -> str:
    """Return the part of a frame that is shown as an SVG image, a JPEG."""
    import cv2

    binning = 1 if view[2] < _WIDE_PX else 2
    left, top, wide, high = (round(value / binning) * binning for value in view)
    camera = recording.camera.windowed((left, top), (wide, high), (binning, binning))
    stage = replace(recording.stage, rig=replace(recording.stage.rig, camera=camera))
    frame = int(np.searchsorted(stage.frame_times.header_ns, time))
    pixels = SimulatedImages(replace(recording, stage=stage)).image(frame)
    good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 78])
    assert good, "OpenCV encodes every 8-bit image"
    encoded = base64.b64encode(bytes(data)).decode()
    at = f'x="{left - 0.5}" y="{top - 0.5}" width="{wide}" height="{high}"'
    return f'<image {at} preserveAspectRatio="none" href="data:image/jpeg;base64,{encoded}"/>'


def _dot(at_px: np.ndarray, colour: str, view: View) -> str:
    unit = view[2] / _WIDTH
    where = f'cx="{at_px[0]:.1f}" cy="{at_px[1]:.1f}" r="{4.0 * unit:.2f}"'
    width = f'stroke-width="{0.8 * unit:.2f}"'
    return f'<circle {where} fill="{colour}" stroke="#fff" {width}/>' if np.isfinite(at_px).all() else ""


def _line(a_px: np.ndarray, b_px: np.ndarray, view: View) -> str:
    (x, y), (u, v) = a_px, b_px
    line = f'<path d="M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}" stroke="#fff" stroke-width="{1.5 * view[2] / _WIDTH:.2f}"/>'
    return line if np.isfinite([a_px, b_px]).all() else ""


def _outline(box: Box, view: View) -> str:
    size = f'width="{box.right_px - box.left_px:.1f}" height="{box.bottom_px - box.top_px:.1f}"'
    style = f'fill="none" stroke="{_BOX}" stroke-width="{2.0 * view[2] / _WIDTH:.2f}"'
    return f'<rect x="{box.left_px:.1f}" y="{box.top_px:.1f}" {size} {style}/>'
