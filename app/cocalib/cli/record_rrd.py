"""`cocalib record-rrd`: write a recording with its calibration for the Rerun viewer."""

from dataclasses import dataclass, field

from calib_core.errors import InputError
from cocalib.cli.flags import NewFile
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recorded, RecordedFlags
from cocalib.cli.shown_recording import Shown, ShownFlags, shown_recording


@dataclass(frozen=True, slots=True)
class RecordRrd:
    """Write a recording with its calibration to an .rrd file for the Rerun viewer."""

    out: NewFile
    """Output file (.rrd); open it with `rerun FILE`, or drop it on a Rerun viewer."""
    shown: Shown = field(default_factory=ShownFlags)
    recorded: Recorded = field(default_factory=RecordedFlags)

    def run(self) -> int:
        """Write the file; return the exit code."""
        from cocalib.rerun import require_sdk, write_view

        require_sdk()
        if self.out.suffix.lower() != ".rrd":
            raise InputError(f"{self.out}: the file for Rerun is an .rrd file; name it NAME.rrd")
        with (
            shown_recording(self.recorded, self.shown) as view,
            progress_bar("writing frames") as progress,
        ):
            written = write_view(view, self.out, progress=progress)
        print(f"{self.out}: {written.frames} frames, {written.scans} scans, {len(view.pairs)} clicks")
        for note in written.skipped.notes():
            print(note)
        print(f"open it with: rerun {self.out}")
        return 0
