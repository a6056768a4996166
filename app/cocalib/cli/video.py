"""`cocalib video`: write a recording's camera frames to a video file, as they are or with what the radar saw."""

from dataclasses import dataclass, field

from calib_core.errors import InputError
from cocalib.cli.flags import NewFile, Switch
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recorded, RecordedFlags
from cocalib.cli.shown_recording import Shown, ShownFlags, shown_recording

_TRAIL_SCANS, _MOST_TRAIL_SCANS = 5, 100


@dataclass(frozen=True, slots=True)
class Video:
    """Write the camera's frames to a video, each at its recorded time; recorded JPEG is not re-encoded.

    With --overlay, the frames are drawn over and encoded: radar returns, clicks, boxes, Acc; all options about what is drawn
    apply with it.
    """

    out: NewFile
    """Output video: .mp4 or .mov (times to a microsecond), or .mkv (to a millisecond)."""
    overlay: Switch = False
    """Draw what the radar saw over the frames, through a calibration."""
    shown: Shown = field(default_factory=ShownFlags)
    trail: int = _TRAIL_SCANS
    """With --overlay: number of earlier scans whose returns stay, smaller the older they are; 0 for none."""
    recorded: Recorded = field(default_factory=RecordedFlags)

    def run(self) -> int:
        """Write the video; return the exit code."""
        if self.overlay:
            return self._write_overlay()
        if self.shown != ShownFlags() or self.trail != _TRAIL_SCANS:
            raise InputError(
                "--calibration, --against, --camera, --clicks, --boxes, --trail and --colour apply with --overlay only; add it"
            )
        from calib_core.recordings import write_video

        with (
            self.recorded.open(require=("image",)) as recording,
            progress_bar("writing frames") as progress,
        ):
            written = write_video(recording, self.out, progress=progress)
        from cocalib.solving.recorded_clicks import seconds_text

        print(f"{self.out}: {written.frames} frames, {written.duration_s:.3f} s, from {seconds_text(written.start)}")
        for warning in recording.warnings:
            if warning.code in ("picture-sizes", "unreadable-pictures"):
                print(f"{warning.message}")
        for note in written.skipped.notes():
            print(note)
        return 0

    def _write_overlay(self) -> int:
        from calib_core.input_files import name_text
        from calib_core.recordings import video_format
        from cocalib.overlay_video import OverlayOptions, write_overlay

        if not 0 <= self.trail <= _MOST_TRAIL_SCANS:
            raise InputError(f"--trail {self.trail}: give a number of scans from 0 to {_MOST_TRAIL_SCANS}")
        video_format(self.out)
        titles = tuple(
            name_text(path.name) for path in (self.shown.calibration, self.shown.against) if path is not None
        )
        with (
            shown_recording(self.recorded, self.shown) as view,
            progress_bar("drawing frames") as progress,
        ):
            written = write_overlay(view, self.out, OverlayOptions(titles, self.trail), progress=progress)
        video, (width, height) = written.video, written.size_px
        print(
            f"{self.out}: {video.frames} frames, {video.duration_s:.3f} s, {width} x {height} px, encoded as {written.codec}"
        )
        for note in video.skipped.notes():
            print(note)
        return 0
