"""One frame of the video: the picture with a calibration's marks, once per calibration, with a strip of figures below."""

from collections.abc import Sequence

import numpy as np

from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.results import Calibration, PairResult
from cocalib.overlay_video.footer import footer_height_px, footers, time_text, write_changing
from cocalib.overlay_video.marks import draw_boxes, draw_clicks, draw_returns, draw_trail
from cocalib.recorded_view import FrameBlock, RecordedView, SeenReturns, seen_in

_HELD_S = 0.5
"""A click stays for so long after its frame, or nobody could see it."""


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
