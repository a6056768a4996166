"""`cocalib rerun`: look at a recording with its calibration in the Rerun viewer."""

import os
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

from cocalib.cli.flags import Switch, called
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recorded, RecordedFlags
from cocalib.cli.shown_recording import Shown, ShownFlags, shown_recording


@dataclass(frozen=True, slots=True)
class Rerun:
    """Show a recording with its calibration in the Rerun viewer."""

    shown: Shown = field(default_factory=ShownFlags)
    web: Switch = False
    """Serve the viewer for a browser on this machine, instead of opening a window."""
    port: Annotated[int, called("PORT")] = 0
    """With --web: the port; 0 takes a free one."""
    recorded: Recorded = field(default_factory=RecordedFlags)

    def run(self) -> int:
        """Show it until the window is closed or Ctrl+C; return the exit code."""
        from cocalib.rerun import open_window, require_display, require_sdk, write_view

        require_sdk()
        if not self.web:
            require_display(os.environ)
        with tempfile.TemporaryDirectory(prefix="cocalib-") as folder:
            path = Path(folder) / "view.rrd"
            with (
                shown_recording(self.recorded, self.shown) as view,
                progress_bar("writing frames") as progress,
            ):
                write_view(view, path, progress=progress)
            return _serve(path, self.port) if self.web else open_window(path)


def _serve(path: Path, port: int) -> int:
    from cocalib.rerun.viewer import serve_view

    with serve_view(path, port) as served:
        print(f"open {served.url}", flush=True)
        print("Ctrl+C ends it", flush=True)
        try:
            served.server.serve_forever()
        except KeyboardInterrupt:
            return 0
    return 0
