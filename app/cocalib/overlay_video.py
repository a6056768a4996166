"""Write a recording as a video with what the radar saw: each frame with marks, once per calibration, and a strip of figures."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from calib_core.arrays import Flags, Points2
from calib_core.errors import InputError, MessageError, RecordingError
from calib_core.file_tag import TAG
from calib_core.measurements import NS_PER_S, Box, RadarScans, TimeNs
from calib_core.recordings import SkippedFrames, WrittenVideo, video_format
from calib_core.results import Calibration
from cocalib.colours import RETURN_RAMPS, residual_colours
from cocalib.platform.files import whole_path
from cocalib.recorded_view import FrameBlock, RecordedView, ReturnColours, SeenReturns, box_words, frame_blocks, seen_in

_LONGEST_SCAN_S = 0.25
_CODECS = {
    "libx264": ("H.264", {"preset": "veryfast", "crf": "21"}),
    "libopenh264": ("H.264", {}),
    "mpeg4": ("MPEG-4", {"qscale": "3"}),
    "mjpeg": ("Motion JPEG", {"qscale": "3"}),
}
"""In order of preference; the first that this build of PyAV can write is used."""
_TICKS_PER_S = 60_000
"""MPEG-4 allows at most 65535."""
_BT709, _LIMITED_RANGE = 1, 1
_HELD_S = 0.5
"""A click stays for so long after its frame, or nobody could see it."""
_BACKGROUND = (20, 16, 13)
_TITLE_FROM = 0.5
"""A title has room between this share of the width and the legend; a longer one is left out."""
_INK, _DIM = (240, 236, 232), (164, 152, 140)
_HUES = ((255, 210, 80), (110, 220, 130), (90, 190, 255), (255, 140, 120), (200, 160, 255), (240, 240, 240))
"""Colours of the classes of boxes, red first."""
LARGE_PX = 30.0
"""Residuals from here on have the last colour, as on the page."""

_SHIFT = 3
_EDGE = (16, 13, 10)
_WHITE = (255, 255, 255)
_RING = (84, 180, 255)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_REFERENCE_HEIGHT_PX = 720
_MANY = 800


@dataclass(frozen=True, slots=True)
class OverlayOptions:
    """How the video looks.

    Attributes:
        titles: of the panels: the calibration's name, and that of the other one, if there is one.
        trail_scans: number of earlier scans whose returns stay, smaller the older they are.
    """

    titles: tuple[str, ...]
    trail_scans: int = 5


@dataclass(frozen=True, slots=True)
class WrittenOverlay:
    """A summary of what was written.

    Attributes:
        video: its frames.
        codec: what they are encoded with.
        size_px: width and height of the video.
    """

    video: WrittenVideo
    codec: str
    size_px: tuple[int, int]


def write_overlay(
    view: RecordedView,
    path: Path,
    options: OverlayOptions,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> WrittenOverlay:
    """Write the camera's frames with the overlay, each at its recorded time; the file takes its name once it is complete.

    Args:
        view: what to draw.
        path: of the video: .mp4, .mov or .mkv.
        options: how it looks.
        progress: called with the frames done and their total.

    Raises:
        InputError: PyAV is missing, the suffix is not supported, or the file cannot be written.
        RecordingError: no frame can be read.
    """
    video_format(path)
    with whole_path(path) as part:
        return _write(view, part, options, progress)


class Panels:
    """Composes the frames of one video.

    Attributes:
        video_size_px: width and height of the video, both even.
    """

    def __init__(
        self, view: RecordedView, titles: Sequence[str], *, trail_scans: int, size_px: tuple[int, int]
    ) -> None:
        """Prepare what does not change.

        Args:
            view: what to draw.
            titles: of the panels: one, or two with another calibration.
            trail_scans: number of earlier scans whose returns stay.
            size_px: width and height of the recorded images.
        """
        width, height = size_px
        strip_px = _footer_height_px(height)
        self.video_size_px = (width * len(titles) + (width * len(titles)) % 2, height + strip_px)
        self._view, self._trail_scans = view, trail_scans
        self._calibrations = [one for one in (view.calibration, view.against) if one is not None]
        self._strips = _footers(width, strip_px, view.colours, titles)
        self._boxes, self._acc = view.boxes_by_frame(), view.acc_by_frame()
        self._labels = view.boxes.labels if view.boxes else ()
        self._clicked = sorted(view.pairs_by_frame().items())
        self._start = TimeNs(int(view.recording.image_times[0]))
        self._seen = [SeenReturns(RadarScans(), np.zeros((0, 2))) for _ in self._calibrations]

    def enter(self, block: FrameBlock) -> None:
        """Project the returns around the frames that follow."""
        self._seen = [seen_in(calibration, block.scans) for calibration in self._calibrations]

    def compose(self, image: np.ndarray, time: TimeNs) -> np.ndarray:
        """Return a frame of the video.

        Args:
            image: uint8 (h, w, 3), blue first, of the size given.
            time: its stamp.
        """
        width, height = self.video_size_px
        frame = np.zeros((height, width, 3), np.uint8)
        rows, columns = image.shape[:2]
        for index, (calibration, seen, strip) in enumerate(
            zip(self._calibrations, self._seen, self._strips, strict=True)
        ):
            own = slice(index * columns, (index + 1) * columns)
            panel = np.ascontiguousarray(image)
            if index + 1 < len(self._calibrations):
                panel = panel.copy()
            self._draw(panel, calibration, seen, time)
            frame[:rows, own] = panel
            below = strip.copy()
            if index == 0:
                letters = _letters(below)
                label(below, self._words(time), (letters, _base_line(below)), _INK, letters)
            frame[rows:, own] = below
        return frame

    def _draw(self, panel: np.ndarray, calibration: Calibration, seen: SeenReturns, time: TimeNs) -> None:
        draw_boxes(panel, self._boxes.get(time, ()), self._labels)
        colours, scans = self._view.colours, seen.scans
        if self._trail_scans:
            earlier = seen.trail(time, self._trail_scans)
            scan_of = np.searchsorted(scans.first_return, earlier, side="right") - 1
            newest = scans.nearest(time) if len(scans) else 0
            _draw_trail(
                panel, seen.pixels_px[earlier], colours.of(scans, earlier), (newest - scan_of) / self._trail_scans
            )
        rows = seen.near(time)
        still = ~(np.abs(scans.doppler_mps[rows]) > calibration.options.gating.max_speed_mps)
        draw_returns(panel, seen.pixels_px[rows], colours.of(scans, rows), still)
        held = round(_HELD_S * NS_PER_S)
        pairs = [pair for clicked, pairs in self._clicked if 0 <= time - clicked <= held for pair in pairs]
        if pairs:
            projected = calibration.reproject(np.array([pair.point_radar_m for pair in pairs]))
            draw_clicks(panel, np.array([pair.pixel_px for pair in pairs]), projected, [pair.id for pair in pairs])

    def _words(self, time: TimeNs) -> str:
        words = time_text(time, self._start)
        if self._acc:
            words += f"   Acc {100 * self._acc[time]:.0f} %" if time in self._acc else "   Acc -"
        return words


def _footer_height_px(image_height_px: int) -> int:
    """Return how high the strip is below an image, so that both together have an even height."""
    height = max(30, round(0.055 * image_height_px))
    return height + (image_height_px + height) % 2


def time_text(time: TimeNs, start: TimeNs) -> str:
    """Write a stamp as date and time (UTC) to a millisecond, and the seconds since the first frame."""
    day = datetime.fromtimestamp(time // NS_PER_S, UTC)
    return f"{day:%Y-%m-%d %H:%M:%S}.{time % NS_PER_S // 10**6:03d} UTC   +{(time - start) / NS_PER_S:.2f} s"


def _footers(width_px: int, height_px: int, colours: ReturnColours, titles: Sequence[str]) -> list[np.ndarray]:
    """Return the strips of the panels, without what changes: titles in the right half, the legend at the end.

    Args:
        width_px: of a panel.
        height_px: of the strip.
        colours: of the returns.
        titles: one per panel.
    """
    strips = [np.full((height_px, width_px, 3), _BACKGROUND, np.uint8) for _ in titles]
    for strip, title in zip(strips, titles, strict=True):
        left = _legend(strip, colours)
        if title:
            letters = _letters(strip)
            width = _label_width_px(title, letters)
            if width < left - _TITLE_FROM * width_px:
                label(strip, title, (left - width - letters, _base_line(strip)), _DIM, letters)
    return strips


def _letters(strip: np.ndarray) -> float:
    """Return the height of capital letters [px] that fits the strip and its width."""
    return min(0.34 * strip.shape[0], strip.shape[1] / 90.0)


def _base_line(strip: np.ndarray) -> float:
    return 0.5 * strip.shape[0] + 0.5 * _letters(strip)


def _legend(strip: np.ndarray, colours: ReturnColours) -> float:
    """Draw the ramp between its two ends; return where it begins [px]."""
    height, width = strip.shape[:2]
    letters = _letters(strip)
    low, high = colours.ends
    ramp = np.array(RETURN_RAMPS["signed" if colours.quantity == "speed" else "rising", False], dtype=np.float64)
    bar_px = max(40, width // 12)
    shares = np.linspace(0.0, 1.0, bar_px)
    stops = np.linspace(0.0, 1.0, len(ramp))
    row = np.stack([np.interp(shares, stops, channel) for channel in ramp[:, ::-1].T], axis=1)
    right = width - round(letters)
    high_px = round(_label_width_px(high, letters))
    bar_right = right - high_px - round(0.6 * letters)
    top, bottom = round(0.36 * height), round(0.64 * height)
    strip[top:bottom, bar_right - bar_px : bar_right] = np.rint(row).astype(np.uint8)
    label(strip, high, (right - high_px, _base_line(strip)), _DIM, letters)
    low_px = bar_right - bar_px - round(0.6 * letters) - round(_label_width_px(low, letters))
    label(strip, low, (low_px, _base_line(strip)), _DIM, letters)
    return float(low_px - letters)


def _text_height_px(image: np.ndarray) -> float:
    """Return the height of capital letters that suits the image."""
    return 12.0 * max(0.75, image.shape[0] / _REFERENCE_HEIGHT_PX)


def draw_returns(image: np.ndarray, pixels_px: Points2, colours: np.ndarray, still: Flags) -> None:
    """Draw returns in their colours: dots are static, triangles are moving, as on the page.

    Args:
        image: uint8 (h, w, 3), blue first; changed.
        pixels_px: (n, 2).
        colours: (n, 3), red first.
        still: (n,) which are static.
    """
    size = 0.4 * _text_height_px(image)
    smooth = cv2.LINE_AA if len(pixels_px) < _MANY else cv2.LINE_8
    blue_first = colours[:, ::-1].tolist()
    for (u_px, v_px), colour, stays in zip(pixels_px.tolist(), blue_first, still.tolist(), strict=True):
        if stays:
            centre = _fixed_point(u_px, v_px)
            cv2.circle(image, centre, round((size + 1.2) * (1 << _SHIFT)), _EDGE, -1, smooth, _SHIFT)
            cv2.circle(image, centre, round(size * (1 << _SHIFT)), colour, -1, smooth, _SHIFT)
        else:
            _triangle(image, u_px, v_px, 1.3 * size + 1.6, _EDGE, smooth)
            _triangle(image, u_px, v_px, 1.3 * size, colour, smooth)


def _draw_trail(image: np.ndarray, pixels_px: Points2, colours: np.ndarray, ages: np.ndarray) -> None:
    """Draw earlier returns as dots that become smaller with age.

    Args:
        image: uint8 (h, w, 3), blue first; changed.
        pixels_px: (n, 2).
        colours: (n, 3), red first.
        ages: (n,) 0 for the newest, 1 for the oldest.
    """
    radii = 0.3 * _text_height_px(image) * (1.0 - 0.75 * ages)
    rows = zip(pixels_px.tolist(), colours[:, ::-1].tolist(), radii.tolist(), strict=True)
    for (u_px, v_px), colour, radius_px in rows:
        cv2.circle(image, _fixed_point(u_px, v_px), round(radius_px * (1 << _SHIFT)), colour, -1, cv2.LINE_8, _SHIFT)


def draw_clicks(image: np.ndarray, clicks_px: Points2, projected_px: Points2, ids: Sequence[str]) -> None:
    """Draw clicks as crosses, their reprojections as rings, and the residuals between them, with their lengths."""
    size = _text_height_px(image)
    lengths_px = np.linalg.norm(projected_px - clicks_px, axis=1)
    colours = residual_colours(lengths_px, LARGE_PX)[:, ::-1].tolist()
    rows = zip(clicks_px.tolist(), projected_px.tolist(), ids, lengths_px.tolist(), colours, strict=True)
    for click, projected, name, length_px, colour in rows:
        (u_px, v_px), seen = click, bool(np.isfinite(projected).all())
        for (left, top), (right, bottom) in (((-1, 0), (1, 0)), ((0, -1), (0, 1))):
            ends = (
                _fixed_point(u_px + left * size, v_px + top * size),
                _fixed_point(u_px + right * size, v_px + bottom * size),
            )
            cv2.line(image, *ends, _EDGE, 3, cv2.LINE_AA, _SHIFT)
            cv2.line(image, *ends, _WHITE, 1, cv2.LINE_AA, _SHIFT)
        if seen:
            cv2.line(image, _fixed_point(u_px, v_px), _fixed_point(*projected), colour, 2, cv2.LINE_AA, _SHIFT)
            cv2.circle(
                image, _fixed_point(*projected), round(0.7 * size * (1 << _SHIFT)), _RING, 2, cv2.LINE_AA, _SHIFT
            )
        words = f"{name}: {length_px:.1f} px" if seen else f"{name}: behind the camera"
        width = _label_width_px(words, size)
        fits = u_px + 1.8 * size + width < image.shape[1]
        left = u_px + 1.8 * size if fits else u_px - 1.8 * size - width
        label(image, words, (left, v_px - 0.9 * size), _WHITE, plate=True)


def draw_boxes(image: np.ndarray, boxes: Sequence[Box], labels: Sequence[str]) -> None:
    """Draw boxes with their classes and tracks, one colour per class."""
    for box in boxes:
        hue = _HUES[labels.index(box.label) % len(_HUES)][::-1] if box.label in labels else _WHITE
        corners = (_fixed_point(box.left_px, box.top_px), _fixed_point(box.right_px, box.bottom_px))
        cv2.rectangle(image, *corners, _EDGE, 4, cv2.LINE_AA, _SHIFT)
        cv2.rectangle(image, *corners, hue, 2, cv2.LINE_AA, _SHIFT)
        words = box_words(box)
        if words:
            label(image, words, (box.left_px, box.top_px - 0.6 * _text_height_px(image)), hue, plate=True)


def label(
    image: np.ndarray,
    words: str,
    place_px: tuple[float, float],
    colour: tuple[int, int, int],
    height_px: float | None = None,
    *,
    plate: bool = False,
) -> float:
    """Write one line inside the image; return its width [px].

    Args:
        image: changed.
        words: to write; what the font does not have becomes a question mark.
        place_px: of the left end of the base line.
        colour: blue first.
        height_px: of capital letters.
        plate: darken what is behind the line, so that it can be read on any image.
    """
    height_px = _text_height_px(image) if height_px is None else height_px
    plain, scale, width = _text_layout(words, height_px)
    u_px = min(max(place_px[0], 2.0), max(2.0, image.shape[1] - width - 2.0))
    v_px = min(max(place_px[1], 1.5 * height_px), image.shape[0] - 0.5 * height_px)
    if plate:
        margin = round(0.4 * height_px)
        top, bottom = max(0, round(v_px - height_px) - margin), round(v_px) + margin
        behind = image[top:bottom, max(0, round(u_px) - margin) : round(u_px + width) + margin]
        behind[:] = behind // 4
    cv2.putText(image, plain, (round(u_px), round(v_px)), _FONT, scale, colour, 1, cv2.LINE_AA)
    return width


def _label_width_px(words: str, height_px: float) -> float:
    """Return how wide a line is [px]."""
    return _text_layout(words, height_px)[2]


def _text_layout(words: str, height_px: float) -> tuple[str, float, float]:
    """Return what can be written of a line, OpenCV's scale for letters of a height, and the width [px]."""
    plain = words.encode("ascii", "replace").decode()
    scale = height_px / cv2.getTextSize("H", _FONT, 1.0, 1)[0][1]
    return plain, scale, float(cv2.getTextSize(plain, _FONT, scale, 1)[0][0])


def _triangle(image: np.ndarray, u_px: float, v_px: float, size: float, colour: Sequence[int], smooth: int) -> None:
    corners = [(u_px, v_px - size), (u_px + 0.9 * size, v_px + 0.7 * size), (u_px - 0.9 * size, v_px + 0.7 * size)]
    cv2.fillConvexPoly(image, np.array([_fixed_point(*corner) for corner in corners]), colour, smooth, _SHIFT)


def _fixed_point(u_px: float, v_px: float) -> tuple[int, int]:
    """Return a place as OpenCV takes it, with fractions of a pixel."""
    return round(u_px * (1 << _SHIFT)), round(v_px * (1 << _SHIFT))


def _write(
    view: RecordedView, path: Path, options: OverlayOptions, progress: Callable[[int, int], None] | None
) -> WrittenOverlay:
    camera, times = view.calibration.camera, view.recording.image_times
    size_px = (camera.width_px, camera.height_px)
    panels = Panels(view, options.titles, trail_scans=options.trail_scans, size_px=size_px)
    duration_s = float(times[-1] - times[0]) / NS_PER_S
    rate = (len(times) - 1) / duration_s if duration_s > 0 else 1.0
    skipped, count, last = SkippedFrames(), 0, TimeNs(int(times[0]))
    with encoding(path, panels.video_size_px, rate) as encoder:
        for time, image in _images(view, panels, skipped, size_px, options, progress):
            encoder.add(panels.compose(image, time), time)
            count, last = count + 1, time
        if encoder.start is None:
            raise RecordingError(
                f"{view.recording.name}: none of its {len(times)} frames can be read: {skipped.fault or 'other sizes'}"
            )
        encoder.finish()
        video = WrittenVideo(count, encoder.start, (last - encoder.start) / NS_PER_S, skipped)
        codec = encoder.codec
    return WrittenOverlay(video, codec, panels.video_size_px)


def _images(
    view: RecordedView,
    panels: Panels,
    skipped: SkippedFrames,
    size_px: tuple[int, int],
    options: OverlayOptions,
    progress: Callable[[int, int], None] | None,
) -> Iterator[tuple[TimeNs, np.ndarray]]:
    """Yield the frames that can be read and have the calibration's size; the panels know the scans around each."""
    recording, total = view.recording, len(view.recording.image_times)
    for block in frame_blocks(recording, trail_s=_LONGEST_SCAN_S * options.trail_scans):
        panels.enter(block)
        for index, time in enumerate(block.times_ns.tolist()):
            if progress:
                progress(block.first + index, total)
            try:
                image = recording.image(block.first + index)
            except MessageError as error:
                skipped.add_unreadable(error)
                continue
            if (image.shape[1], image.shape[0]) != size_px:
                skipped.other_size += 1
                continue
            yield TimeNs(time), image


@dataclass(slots=True)
class _Encoder:
    """A video that is being written.

    Attributes:
        codec: what it is encoded with, for the user.
    """

    codec: str
    container: Any
    stream: Any
    start: TimeNs | None = None
    ticks: int = -1

    def add(self, image: np.ndarray, time: TimeNs) -> None:
        """Append a frame.

        Args:
            image: uint8 (h, w, 3), blue first, of the size given.
            time: its stamp.
        """
        import av

        self.start = time if self.start is None else self.start
        self.ticks = max(self.ticks + 1, round((time - self.start) * _TICKS_PER_S / NS_PER_S))
        frame = av.VideoFrame.from_ndarray(image, format="bgr24")
        frame = frame.reformat(format=self.stream.pix_fmt, dst_colorspace="ITU709")
        frame.pts, frame.time_base = self.ticks, Fraction(1, _TICKS_PER_S)
        self.container.mux(self.stream.encode(frame))

    def finish(self) -> None:
        """Write what the codec still holds back."""
        self.container.mux(self.stream.encode(None))


@contextmanager
def encoding(path: Path, size_px: tuple[int, int], frames_per_s: float) -> Iterator[_Encoder]:
    """Yield an encoder that writes a file; the caller finishes it.

    Args:
        path: of the video.
        size_px: width and height, both even.
        frames_per_s: on average.

    Raises:
        InputError: PyAV is missing or has no codec, or the suffix is not supported.
    """
    form = video_format(path)
    import av

    name = next((name for name in _CODECS if _can_write(name)), None)
    if name is None:
        raise InputError(
            f"PyAV has none of the codecs {', '.join(_CODECS)}; install the wheel: pip install 'cocalib[video]'"
        )
    label, options = _CODECS[name]
    with av.open(str(path), "w", format=form) as container:
        container.metadata["comment"] = TAG
        stream: Any = container.add_stream(name, rate=max(1, round(frames_per_s)), options=options)
        stream.width, stream.height = size_px
        stream.pix_fmt = "yuvj420p" if name == "mjpeg" else "yuv420p"
        stream.codec_context.time_base = Fraction(1, _TICKS_PER_S)
        stream.codec_context.colorspace = stream.codec_context.color_primaries = stream.codec_context.color_trc = _BT709
        if name != "mjpeg":
            stream.codec_context.color_range = _LIMITED_RANGE
        yield _Encoder(label, container, stream)


def _can_write(name: str) -> bool:
    from av.codec import Codec
    from av.codec.codec import UnknownCodecError

    try:
        return bool(Codec(name, "w").name)
    except UnknownCodecError:
        return False
