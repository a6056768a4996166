"""What changes with time (radar cloud, images with returns, boxes, clicks, figures), and how the viewer lays it out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from calib_core.arrays import Indices, TimesNs
from calib_core.errors import MessageError
from calib_core.measurements import Box, TimeNs
from calib_core.recordings import SkippedFrames
from calib_core.results import PairResult
from cocalib.colours import residual_colours
from cocalib.recorded_view import FrameBlock, RecordedView, SeenReturns, box_words, frame_blocks, seen_in
from cocalib.rerun.unmoving import (
    ACC,
    AED,
    AGAINST_RETURNS,
    BOXES,
    CLICKED_NOW,
    HALF_PIXEL_PX,
    IMAGE,
    LARGE_PX,
    METRICS,
    RADAR,
    RESIDUALS,
    RETURNS,
    RETURNS_SEEN,
    SEEN_RETURNS,
    SUMMARY,
    TIMELINE,
    ellipse_strips,
)

_AGAINST = (230, 120, 230)
_CHUNK_BYTES = 4 << 20
_HUES = ((255, 210, 80), (110, 220, 130), (90, 190, 255), (255, 140, 120), (200, 160, 255), (240, 240, 240))
_BACKGROUND = (13, 16, 20)


@dataclass(slots=True)
class Streamed:
    """What was written so far.

    Attributes:
        frames: number of images.
        skipped: frames that are left out.
    """

    frames: int = 0
    skipped: SkippedFrames = field(default_factory=SkippedFrames)


def stream_cloud(stream: rr.RecordingStream, view: RecordedView) -> Iterator[TimesNs]:
    """Write every scan's returns in the radar's frame, colored; yield the stamps of what was written."""
    for window in view.recording.radar_windows():
        known = np.flatnonzero(np.isfinite(window.points_radar_m).all(axis=1))
        scans = window.take(known)
        if len(scans):
            columns = rr.Points3D.columns(positions=scans.points_radar_m, colors=view.colours.of(scans))
            stream.send_columns(
                RETURNS, [_times(scans.times_ns)], columns.partition(np.diff(scans.first_return).tolist())
            )
            stream.flush()  # what is not on the disk yet stays in memory
        yield scans.times_ns


def stream_frames(stream: rr.RecordingStream, view: RecordedView, streamed: Streamed) -> Iterator[int]:
    """Write the images with everything that is drawn over them; yield the number of frames done."""
    pairs, boxes = view.pairs_by_frame(), view.boxes_by_frame()
    labels = view.boxes.labels if view.boxes else ()
    for block in frame_blocks(view.recording):
        yield from _stream_images(stream, view, block, streamed)
        _stream_returns(stream, view, block, streamed)
        if pairs:
            _stream_clicks(stream, block, pairs)
        if view.boxes is not None:
            _stream_boxes(stream, block, boxes, labels)


def _stream_images(
    stream: rr.RecordingStream, view: RecordedView, block: FrameBlock, streamed: Streamed
) -> Iterator[int]:
    """Write the recorded images, untouched, some megabytes at a time."""
    images: list[bytes] = []
    formats: list[str] = []
    times: list[int] = []
    for index, time in enumerate(block.times_ns.tolist()):
        try:
            image = view.recording.image_bytes(block.first + index)
        except MessageError as error:
            streamed.skipped.add_unreadable(error)
            continue
        images.append(image.data)
        formats.append(f"image/{image.format}")
        times.append(time)
        if sum(map(len, images)) >= _CHUNK_BYTES:
            _send_images(stream, images, formats, times, streamed)
            images, formats, times = [], [], []
            yield block.first + index
    if images:
        _send_images(stream, images, formats, times, streamed)
    yield block.first + len(block.times_ns)


def _send_images(
    stream: rr.RecordingStream, images: list[bytes], formats: list[str], times: list[int], streamed: Streamed
) -> None:
    columns = rr.EncodedImage.columns(blob=images, media_type=formats)
    stream.send_columns(IMAGE, [_times(np.array(times, dtype=np.int64))], columns)
    stream.flush()
    streamed.frames += len(images)


def _stream_returns(stream: rr.RecordingStream, view: RecordedView, block: FrameBlock, streamed: Streamed) -> None:
    """Write the returns of each frame's nearest scan where our lens projects them."""
    returns = seen_in(view.calibration, block.scans)
    rows = _rows_of_frames(returns, block.times_ns)
    colours = view.colours.of(block.scans, np.concatenate(rows))
    _send_points(stream, SEEN_RETURNS, block.times_ns, returns, rows, colours)
    counts = [len(own) for own in rows]
    stream.send_columns(
        RETURNS_SEEN, [_times(block.times_ns)], rr.Scalars.columns(scalars=np.array(counts, dtype=float))
    )
    if view.against is not None:
        others = seen_in(view.against, block.scans)
        rows = _rows_of_frames(others, block.times_ns)
        plain = np.tile(np.array(_AGAINST, dtype=np.uint8), (sum(map(len, rows)), 1))
        _send_points(stream, AGAINST_RETURNS, block.times_ns, others, rows, plain)


def _rows_of_frames(returns: SeenReturns, times_ns: TimesNs) -> list[Indices]:
    return [returns.near(TimeNs(time)) for time in times_ns.tolist()]


def _send_points(
    stream: rr.RecordingStream,
    entity: str,
    times_ns: TimesNs,
    returns: SeenReturns,
    rows: Sequence[Indices],
    colours: np.ndarray,
) -> None:
    positions = returns.pixels_px[np.concatenate(rows)] + HALF_PIXEL_PX
    columns = rr.Points2D.columns(positions=positions, colors=colours)
    stream.send_columns(entity, [_times(times_ns)], columns.partition([len(own) for own in rows]))


def _stream_boxes(
    stream: rr.RecordingStream,
    block: FrameBlock,
    boxes: dict[TimeNs, tuple[Box, ...]],
    labels: Sequence[str],
) -> None:
    """Write the boxes of each frame; a frame without any clears those before it."""
    own = [boxes.get(TimeNs(time), ()) for time in block.times_ns.tolist()]
    all_boxes = [box for frame in own for box in frame]
    edges = np.array([(box.left_px, box.top_px, box.right_px, box.bottom_px) for box in all_boxes]).reshape(-1, 4)
    columns = rr.Boxes2D.columns(
        centers=(edges[:, :2] + edges[:, 2:]) / 2.0 + HALF_PIXEL_PX,
        half_sizes=(edges[:, 2:] - edges[:, :2]) / 2.0,
        labels=[box_words(box) or "object" for box in all_boxes],
        colors=[_HUES[labels.index(box.label) % len(_HUES)] for box in all_boxes],
    )
    stream.send_columns(BOXES, [_times(block.times_ns)], columns.partition([len(frame) for frame in own]))


def _stream_clicks(stream: rr.RecordingStream, block: FrameBlock, pairs: dict[TimeNs, tuple[PairResult, ...]]) -> None:
    """Write the clicks of a frame, their reprojections and ellipses; the next frame without clicks clears them."""
    shown = True
    for time in block.times_ns.tolist():
        own = pairs.get(TimeNs(time))
        if own is None and not shown:
            continue
        stream.set_time(TIMELINE, timestamp=np.datetime64(time, "ns"))
        if own is None:
            stream.log(CLICKED_NOW, rr.Clear(recursive=True))
        else:
            _log_clicks(stream, own)
        shown = own is not None


def _log_clicks(stream: rr.RecordingStream, pairs: Sequence[PairResult]) -> None:
    seen = [pair for pair in pairs if np.isfinite(pair.projected_px).all()]
    clicks = np.array([pair.pixel_px for pair in pairs]) + HALF_PIXEL_PX
    labels = [f"{pair.id}: {pair.distance_px:.1f} px" for pair in pairs]
    white = rr.Points2D(
        clicks, colors=(255, 255, 255), radii=rr.Radius.ui_points(4.0), labels=labels, draw_order=50.0, show_labels=True
    )
    stream.log(f"{CLICKED_NOW}/click", white)
    colours = residual_colours(np.array([pair.distance_px for pair in seen]), LARGE_PX)
    places = np.array([pair.projected_px for pair in seen]).reshape(-1, 2) + HALF_PIXEL_PX
    lines = [np.array([pair.pixel_px, pair.projected_px]) + HALF_PIXEL_PX for pair in seen]
    stream.log(f"{CLICKED_NOW}/reprojection", rr.Points2D(places, colors=colours, radii=rr.Radius.ui_points(5.0)))
    stream.log(f"{CLICKED_NOW}/residual", rr.LineStrips2D(lines, colors=colours, radii=rr.Radius.ui_points(1.5)))
    outlines = rr.LineStrips2D(ellipse_strips(seen), colors=(255, 255, 255, 160), radii=rr.Radius.ui_points(1.0))
    stream.log(f"{CLICKED_NOW}/ellipse_95", outlines)


def stream_figures(stream: rr.RecordingStream, view: RecordedView) -> None:
    """Write the residual of each clicked frame, AED as a line, and Acc of each frame that counts."""
    stream.log(RETURNS_SEEN, rr.SeriesLines(names="returns in the image", colors=(108, 199, 255)), static=True)
    known = [(pair.image_time, pair.distance_px) for pair in view.pairs if np.isfinite(pair.distance_px)]
    residuals = sorted((time, length_px) for time, length_px in known if time is not None)
    if residuals:
        stream.log(
            RESIDUALS, rr.SeriesPoints(names="residual [px]", colors=(255, 180, 84), marker_sizes=4.0), static=True
        )
        stream.log(AED, rr.SeriesLines(names="AED [px]", colors=(154, 166, 178)), static=True)
        times = np.array([time for time, _ in residuals], dtype=np.int64)
        lengths_px = np.array([length_px for _, length_px in residuals])
        stream.send_columns(RESIDUALS, [_times(times)], rr.Scalars.columns(scalars=lengths_px))
        ends = view.recording.image_times[[0, -1]]
        stream.send_columns(AED, [_times(ends)], rr.Scalars.columns(scalars=np.full(2, lengths_px.mean())))
    acc = sorted(view.acc_by_frame().items())
    if acc:
        stream.log(ACC, rr.SeriesPoints(names="Acc [%]", colors=(110, 220, 130), marker_sizes=3.0), static=True)
        times = np.array([time for time, _ in acc], dtype=np.int64)
        shares = 100.0 * np.array([share for _, share in acc])
        stream.send_columns(ACC, [_times(times)], rr.Scalars.columns(scalars=shares))


def _times(times_ns: TimesNs) -> rr.TimeColumn:
    return rr.TimeColumn(TIMELINE, timestamp=times_ns.astype("datetime64[ns]"))


def layout(view: RecordedView) -> rrb.Blueprint:
    """Return the blueprint for what there is to show."""
    series = [_series("Returns in the image", RETURNS_SEEN)]
    if view.pairs:
        series.insert(0, _series("Residuals [px]", RESIDUALS, AED))
    if view.acc_by_frame():
        series.insert(0, _series("Acc [%]", ACC))
    image = rrb.Spatial2DView(origin=IMAGE, name="Image")
    far_m = view.colours.high if view.colours.quantity == "range" else 30.0
    eye = rrb.EyeControls3D(
        position=(-0.35 * far_m, 0.0, 0.35 * far_m), look_target=(0.3 * far_m, 0.0, 0.0), eye_up=(0, 0, 1)
    )
    space = rrb.Spatial3DView(origin=RADAR, name="Radar frame", background=_BACKGROUND, eye_controls=eye)
    summary = rrb.TextDocumentView(origin=SUMMARY, name="Summary")
    left = rrb.Vertical(image, *series, row_shares=[3.0, *([1.0] * len(series))])
    right = rrb.Vertical(space, summary, row_shares=[3.0, 1.6])
    return rrb.Blueprint(
        rrb.Horizontal(left, right, column_shares=[1.2, 1.0]),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )


def _series(name: str, *contents: str) -> rrb.TimeSeriesView:
    """Return a plot over the whole recording."""
    always = rr.TimeRange(start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite())
    return rrb.TimeSeriesView(
        origin=METRICS,
        contents=list(contents),
        name=name,
        axis_x=rrb.TimeAxis(view_range=always),
        plot_legend=rrb.Corner2D.LeftTop,
    )
