"""`cocalib rerun`: look at a recording with its calibration in the Rerun viewer."""

import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from app.cli.flags import File, Switch, called
from app.cli.output import progress_bar
from app.cli.recording_flags import Recordings, TopicFlags, Topics
from app.cli.shown_recording import ShownFiles, shown_recording

__all__ = ["Rerun"]


@dataclass(frozen=True, slots=True)
class Rerun:
    """Show a recording with its calibration in the Rerun viewer."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
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
    web: Switch = False
    """Serve the viewer for a browser on this machine, instead of opening a window."""
    port: Annotated[int, called("PORT")] = 0
    """With --web: the port; 0 takes a free one."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Show it until the window is closed or Ctrl+C; return the exit code."""
        from app.rerun import open_window, require_display, require_sdk, write_view

        require_sdk()
        if not self.web:
            require_display(os.environ)
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
        with tempfile.TemporaryDirectory(prefix="cocalib-") as folder:
            path = Path(folder) / "view.rrd"
            with shown_recording(files) as view, progress_bar("writing frames") as progress:
                write_view(view, path, progress=progress)
            return _serve(path, self.port) if self.web else open_window(path)


def _serve(path: Path, port: int) -> int:
    from app.rerun.web_viewer import serve_view

    with serve_view(path, port) as served:
        print(f"open {served.url}", flush=True)
        print("Ctrl+C ends it", flush=True)
        try:
            served.server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0
