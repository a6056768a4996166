"""One frame of the video: the picture with a calibration's marks, once per calibration, with a strip of figures below."""

from collections.abc import Sequence
from datetime import UTC, datetime

import numpy as np

from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.results import Calibration, PairResult
from cocalib.colours import RETURN_RAMPS
from cocalib.overlay_video.marks import draw_boxes, draw_clicks, draw_returns, draw_trail, label, label_width_px
from cocalib.recorded_view import FrameBlock, RecordedView, ReturnColours, SeenReturns, seen_in

_HELD_S = 0.5
"""A click stays for so long after its frame, or nobody could see it."""
_BACKGROUND = (20, 16, 13)
_TITLE_FROM = 0.5
"""A title has room between this share of the width and the legend; a longer one is left out."""
_INK, _DIM = (240, 236, 232), (164, 152, 140)


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
            size_px: width and height of the recorded pictures.
        """
        width, height = size_px
        strip_px = footer_height_px(height)
        self.video_size_px = (width * len(titles) + (width * len(titles)) % 2, height + strip_px)
        self._view, self._trail_scans = view, trail_scans
        self._calibrations = [one for one in (view.calibration, view.against) if one is not None]
        self._strips = footers(width, strip_px, view.colours, titles)
        self._boxes, self._acc = view.boxes_by_frame(), view.acc_by_frame()
        self._labels = view.boxes.labels if view.boxes else ()
        self._clicked = sorted(view.pairs_by_frame().items())
        self._start = TimeNs(int(view.recording.image_times[0]))
        self._seen = [SeenReturns(RadarScans(), np.zeros((0, 2))) for _ in self._calibrations]

    def enter(self, block: FrameBlock) -> None:
        """Project the returns around the frames that follow."""
        self._seen = [seen_in(calibration, block.scans) for calibration in self._calibrations]

    def compose(self, picture: np.ndarray, time: TimeNs) -> np.ndarray:
        """Return a frame of the video.

        Args:
            picture: uint8 (h, w, 3), blue first, of the size given.
            time: its stamp.
        """
        width, height = self.video_size_px
        frame = np.zeros((height, width, 3), np.uint8)
        rows, columns = picture.shape[:2]
        for place, (calibration, seen, strip) in enumerate(
            zip(self._calibrations, self._seen, self._strips, strict=True)
        ):
            own = slice(place * columns, (place + 1) * columns)
            panel = np.ascontiguousarray(picture)
            if place + 1 < len(self._calibrations):
                panel = panel.copy()
            self._draw(panel, calibration, seen, time)
            frame[:rows, own] = panel
            below = strip.copy()
            if place == 0:
                write_changing(below, self._words(time))
            frame[rows:, own] = below
        return frame

    def _draw(self, panel: np.ndarray, calibration: Calibration, seen: SeenReturns, time: TimeNs) -> None:
        draw_boxes(panel, self._boxes.get(time, ()), self._labels)
        colours, scans = self._view.colours, seen.scans
        if self._trail_scans:
            earlier = seen.trail(time, self._trail_scans)
            scan_of = np.searchsorted(scans.first_return, earlier, side="right") - 1
            newest = scans.nearest(time) if len(scans) else 0
            draw_trail(
                panel, seen.pixels_px[earlier], colours.of(scans, earlier), (newest - scan_of) / self._trail_scans
            )
        rows = seen.near(time)
        still = ~(np.abs(scans.doppler_mps[rows]) > calibration.options.gating.max_speed_mps)
        draw_returns(panel, seen.pixels_px[rows], colours.of(scans, rows), still)
        pairs = self._pairs_at(time)
        if pairs:
            projected = calibration.reproject(np.array([pair.point_radar_m for pair in pairs]))
            draw_clicks(panel, np.array([pair.pixel_px for pair in pairs]), projected, [pair.id for pair in pairs])

    def _pairs_at(self, time: TimeNs) -> tuple[PairResult, ...]:
        """Return the pairs of this frame, and of those shortly before it."""
        held = round(_HELD_S * NS_PER_S)
        return tuple(pair for clicked, pairs in self._clicked if 0 <= time - clicked <= held for pair in pairs)

    def _words(self, time: TimeNs) -> str:
        words = time_text(time, self._start)
        if self._acc:
            words += f"   Acc {100 * self._acc[time]:.0f} %" if time in self._acc else "   Acc -"
        return words


def footer_height_px(picture_height_px: int) -> int:
    """Return how high the strip is below a picture, so that both together have an even height."""
    height = max(30, round(0.055 * picture_height_px))
    return height + (picture_height_px + height) % 2


def time_text(time: TimeNs, start: TimeNs) -> str:
    """Write a stamp as date and time (UTC) to a millisecond, and the seconds since the first frame."""
    day = datetime.fromtimestamp(time // NS_PER_S, UTC)
    return f"{day:%Y-%m-%d %H:%M:%S}.{time % NS_PER_S // 10**6:03d} UTC   +{(time - start) / NS_PER_S:.2f} s"


def footers(width_px: int, height_px: int, colours: ReturnColours, titles: Sequence[str]) -> list[np.ndarray]:
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
            width = label_width_px(title, letters)
            if width < left - _TITLE_FROM * width_px:
                label(strip, title, (left - width - letters, _base_line(strip)), _DIM, letters)
    return strips


def write_changing(strip: np.ndarray, words: str) -> None:
    """Write what changes from frame to frame at the left end of a strip."""
    letters = _letters(strip)
    label(strip, words, (letters, _base_line(strip)), _INK, letters)


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
    high_px = round(label_width_px(high, letters))
    bar_right = right - high_px - round(0.6 * letters)
    top, bottom = round(0.36 * height), round(0.64 * height)
    strip[top:bottom, bar_right - bar_px : bar_right] = np.rint(row).astype(np.uint8)
    label(strip, high, (right - high_px, _base_line(strip)), _DIM, letters)
    low_px = bar_right - bar_px - round(0.6 * letters) - round(label_width_px(low, letters))
    label(strip, low, (low_px, _base_line(strip)), _DIM, letters)
    return float(low_px - letters)
