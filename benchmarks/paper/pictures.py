"""Figs. 2 to 6 as SVG: rendered frames with what is clicked and projected, and histograms of Acc; all simulated."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.paper.moving import judged_by_both, recording_of
from benchmarks.paper.rows import (
    by_checkerboard,
    by_mounting,
    calibrated,
    measured_pairs,
    points_and_pixels,
    with_gross_errors,
)
from benchmarks.paper.settings import Dataset, Settings, options_of, ppm_options
from calib_core.arrays import Points2
from calib_core.evaluation import BoxFigures
from calib_core.results import Calibration
from calib_core.results.metrics import aed, distances
from calib_core.synthetic import PresetName, SimulatedRecording, simulate, simulate_scans
from calib_core.synthetic.recording import SimulatedPictures

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


@dataclass(frozen=True, slots=True)
class Panel:
    """One picture of a figure.

    Attributes:
        title: below the figure's.
        inside: SVG in its own units.
        view: left, top, width and height of what is shown, in these units.
    """

    title: str
    inside: str
    view: tuple[float, float, float, float]


def write_pictures(folder: Path, seed: int, settings: Settings) -> None:
    """Write fig-2.svg to fig-6.svg of one seed.

    Args:
        folder: created if it does not exist.
        seed: the first of the table.
        settings: of the table.
    """
    folder.mkdir(parents=True, exist_ok=True)
    clicked = "red: clicks, blue: projected radar positions"
    moving = "yellow: true boxes, blue: returns inside their own, orange: outside"
    figures = {
        "fig-2": (f"Fig. 2, simulated: D1 ({clicked})", _d1(seed, settings)),
        "fig-3": (f"Fig. 3, simulated: D2 ({clicked})", _d2(seed, settings)),
        "fig-4": (f"Fig. 4, simulated: D3, the aisle ({clicked})", _d3(seed, settings)),
        "fig-5": (f"Fig. 5, simulated: (a) PPM, (b) PMM ({moving})", _real_world(seed, settings)),
        "fig-6": (
            "Fig. 6, simulated: share of frames by their Acc, frames of 0 % included",
            _histograms(seed, settings),
        ),
    }
    for name, (title, panels) in figures.items():
        (folder / f"{name}.svg").write_text(_figure(title, panels), encoding="utf-8")


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


def _d1(seed: int, settings: Settings) -> list[Panel]:
    recording, ppm = _solved("d1", seed, settings)
    pmm = by_mounting(simulate_scans(recording.options), measured_pairs(ppm))
    return _clicked(recording, [("(A) PPM+D1", ppm), ("(B) PMM+D1", pmm)])


def _d2(seed: int, settings: Settings) -> list[Panel]:
    recording, ppm = _solved("d2", seed, settings)
    pairs = measured_pairs(ppm)
    matrix = by_checkerboard(simulate_scans(recording.options), pairs)
    at_px = matrix.project(points_and_pixels(pairs)[0], ppm.camera)
    results = tuple(replace(one, projected_px=at) for one, at in zip(ppm.pairs, at_px, strict=True))
    return _clicked(recording, [("(A) PPM+D2", ppm), ("(B) CCM+D2", replace(ppm, pairs=results))])


def _d3(seed: int, settings: Settings) -> list[Panel]:
    recording, same = _solved("d3", seed, settings)
    simulated, other = simulate_scans(recording.options).other_camera, recording.other_camera
    assert simulated is not None, "D3 has a second camera"
    assert other is not None, "D3 has a second camera"
    apart = with_gross_errors(simulated, settings, settings.gross_pairs, ppm_options(settings)).unwrap()
    wrong = f"{settings.gross_pairs} radar positions wrong by {settings.gross_m:g} m"
    return [
        *_clicked(recording, [("(A) same rig", same)]),
        *_clicked(other, [(f"(B) other rig, {wrong}", apart)]),
    ]


def _solved(dataset: Dataset, seed: int, settings: Settings) -> tuple[SimulatedRecording, Calibration]:
    options = options_of(dataset, seed, settings)
    return simulate(options), calibrated(simulate_scans(options), settings).unwrap()


def _clicked(recording: SimulatedRecording, calibrations: Sequence[tuple[str, Calibration]]) -> list[Panel]:
    """Draw clicks and projections on the frame of the first click."""
    first = recording.clicks[0].image_time
    frame = int(np.searchsorted(recording.stage.frame_times.header_ns, first))
    pixels = np.array([pair.pixel_px for pair in calibrations[0][1].pairs])
    view = _view_around(pixels, recording, least=0.3)
    back = _background(recording, frame, view)
    panels = []
    for title, one in calibrations:
        at = np.array([pair.projected_px for pair in one.pairs])
        marks = [_line(a, b, view) for a, b in zip(pixels, at, strict=True)]
        marks += [_dot(a, _CLICK, view) for a in pixels] + [_dot(b, _AT, view) for b in at]
        panels.append(Panel(f"{title}: AED {aed(distances(at, pixels)):.1f} px", back + "".join(marks), view))
    return panels


def _real_world(seed: int, settings: Settings) -> list[Panel]:
    return [
        *_moving("people", "(A) people on the rooftop", seed, settings),
        *_moving("robot", "(B) robot car in the aisle, seen from the other rig", seed, settings),
        *_moving("cars-near", "(C) cars on the road", seed, settings),
        *_moving("cars-far", f"(D) a car beyond {_FAR_M:g} m", seed, settings, nearest_m=_FAR_M),
    ]


def _moving(preset: PresetName, title: str, seed: int, settings: Settings, nearest_m: float = 0.0) -> list[Panel]:
    """Draw the frame with the most returns at or beyond a range, by PPM and by PMM."""
    recording, both = recording_of(preset, seed, settings), judged_by_both(preset, seed, settings, labelled=True)
    returns = both[0].returns
    assert returns is not None, "they were judged here"
    far = np.linalg.norm(returns.points_radar_m, axis=1) >= nearest_m
    boxed = np.isfinite(returns.boxes_px).all(axis=1)
    number = int(np.bincount(returns.frames[far & boxed]).argmax())
    own = (returns.frames == number) & far
    frame = int(np.searchsorted(recording.stage.frame_times.header_ns, both[0].frames[number].image_time))
    boxes = np.unique(returns.boxes_px[own & boxed], axis=0)
    view = _view_around(boxes.reshape(-1, 2), recording, least=0.25)
    back = _background(recording, frame, view)
    panels = []
    for letter, figures in zip("ab", both, strict=True):
        found = figures.returns
        assert found is not None, "they were judged here"
        marks = [_outline(box, view) for box in boxes]
        inside, at = found.inside[own], found.pixels_px[own]
        marks += [_dot(a, _AT if good else _MISSED, view) for a, good in zip(at, inside, strict=True)]
        share = f"{int(inside.sum())} of {len(inside)} returns inside"
        panels.append(Panel(f"{title[:2]}, {letter}{title[2:]}: {share}", back + "".join(marks), view))
    return panels


def _histograms(seed: int, settings: Settings) -> list[Panel]:
    panels = []
    for letters, preset, name in (("ab", "people", "people walking"), ("cd", "cars-far", "cars, 20 to 60 m")):
        both = judged_by_both(preset, seed, settings)  # type: ignore[arg-type]
        for letter, method, figures in zip(letters, ("PPM", "PMM"), both, strict=True):
            panels.append(_histogram(f"({letter}) {method}, {name}: Acc {100 * (figures.acc or 0.0):.0f} %", figures))
    return panels


def _histogram(title: str, figures: BoxFigures) -> Panel:
    shares = [frame.share for frame in figures.frames if frame.returns]
    counts = np.histogram(shares, np.linspace(0.0, 1.0, 11))[0] / max(len(shares), 1)
    left, low, tall, step = 50.0, _HEIGHT - 45.0, _HEIGHT - 70.0, (_WIDTH - 70.0) / 10.0
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
    return Panel(title, "".join(parts), (0.0, 0.0, float(_WIDTH), float(_HEIGHT)))


def _view_around(
    pixels_px: Points2, recording: SimulatedRecording, *, least: float
) -> tuple[float, float, float, float]:
    """Return the part of the picture around some pixels: left, top, width, height; at least a share of its width."""
    camera = recording.camera
    low, high = pixels_px.min(axis=0), pixels_px.max(axis=0)
    shape = camera.width_px / camera.height_px
    wide = max(1.4 * (high[0] - low[0]), 1.4 * shape * (high[1] - low[1]), least * camera.width_px)
    wide = min(wide, float(camera.width_px))
    size = np.array([wide, wide / shape])
    corner = np.clip(0.5 * (low + high - size), 0.0, np.array([camera.width_px, camera.height_px]) - size)
    return float(corner[0]), float(corner[1]), float(size[0]), float(size[1])


def _background(recording: SimulatedRecording, frame: int, view: tuple[float, float, float, float]) -> str:
    """Return the part of a frame that is shown as an SVG image, a JPEG."""
    import cv2

    binning = 1 if view[2] < _WIDE_PX else 2
    left, top, wide, high = (round(value / binning) * binning for value in view)
    camera = recording.camera.windowed((left, top), (wide, high), (binning, binning))
    stage = replace(recording.stage, rig=replace(recording.stage.rig, camera=camera))
    pixels = SimulatedPictures(replace(recording, stage=stage)).image(frame)
    good, data = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, 78])
    assert good, "OpenCV encodes every 8-bit picture"
    encoded = base64.b64encode(bytes(data)).decode()
    at = f'x="{left - 0.5}" y="{top - 0.5}" width="{wide}" height="{high}"'
    return f'<image {at} preserveAspectRatio="none" href="data:image/jpeg;base64,{encoded}"/>'


def _dot(at_px: np.ndarray, colour: str, view: tuple[float, float, float, float]) -> str:
    if not np.isfinite(at_px).all():
        return ""
    unit = view[2] / _WIDTH
    return (
        f'<circle cx="{at_px[0]:.1f}" cy="{at_px[1]:.1f}" r="{4.0 * unit:.2f}" fill="{colour}" '
        f'stroke="#fff" stroke-width="{0.8 * unit:.2f}"/>'
    )


def _line(a_px: np.ndarray, b_px: np.ndarray, view: tuple[float, float, float, float]) -> str:
    if not np.isfinite([a_px, b_px]).all():
        return ""
    (x, y), (u, v) = a_px, b_px
    unit = view[2] / _WIDTH
    return f'<path d="M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}" stroke="#fff" stroke-width="{1.5 * unit:.2f}"/>'


def _outline(box_px: np.ndarray, view: tuple[float, float, float, float]) -> str:
    left, top, right, bottom = box_px
    size = f'x="{left:.1f}" y="{top:.1f}" width="{right - left:.1f}" height="{bottom - top:.1f}"'
    return f'<rect {size} fill="none" stroke="{_BOX}" stroke-width="{2.0 * view[2] / _WIDTH:.2f}"/>'
