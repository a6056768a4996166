"""`cocalib record-rrd`: write a recording with its calibration for the Rerun viewer."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

from app.cli.flags import File, NewFile, called
from app.cli.output import progress_bar
from app.cli.recording_flags import Recordings, TopicFlags, Topics
from app.cli.shown_recording import ShownFiles, shown_recording
from calib_core.errors import InputError

__all__ = ["RecordRrd"]


@dataclass(frozen=True, slots=True)
class RecordRrd:
    """Write a recording with its calibration to an .rrd file for the Rerun viewer."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
    out: NewFile
    """Output file (.rrd); open it with `rerun FILE`, or drop it on a Rerun viewer."""
    calibration: File = None
    """Calibration to project the returns with, in any format that export writes."""
    camera: File = None
    """Intrinsics to use if the calibration has none, or instead of the recording's: camera_info YAML, OpenCV, Kalibr, JSON."""
    clicks: File = None
    """Clicks in this recording (cocalib/clicks-1 JSON); by default those in the calibration, if they are of this recording."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC")] = None
    """Boxes around objects, drawn with their classes and evaluated (Acc): a file of a labelling tool, or a topic."""
    against: File = None
    """Another calibration, whose returns and frustum are shown too."""
    colour: Literal["range", "speed"] = "range"
    """What the colours of returns show."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Write the file; return the exit code."""
        from app.rerun import require_sdk, write_view

        require_sdk()
        if self.out.suffix.lower() != ".rrd":
            raise InputError(f"{self.out}: the file for Rerun is an .rrd file; name it NAME.rrd")
        files = ShownFiles(
            self.recording,
            self.topics,
            self.calibration,
            self.camera,
            self.clicks,
            self.boxes,
            self.against,
            self.colour,
        )
        with shown_recording(files) as view, progress_bar("writing frames") as progress:
            written = write_view(view, self.out, progress=progress)
        print(f"{self.out}: {written.frames} frames, {written.scans} scans, {len(view.pairs)} clicks")
        if written.unreadable:
            print(f"{written.unreadable} frames are left out because they cannot be read: {written.fault}")
        print(f"open it with: rerun {self.out}")
        return 0
