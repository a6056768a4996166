"""`cocalib info`: show what is in a recording."""

import sys
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from calib_core.errors import InputError
from cocalib.cli.flags import Switch
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recordings, TopicFlags, Topics
from cocalib.platform.files import write_whole

if TYPE_CHECKING:
    from calib_core.recordings import Recording


@dataclass(frozen=True, slots=True)
class Info:
    """Show what a recording contains: files, topics, types, rates, stamps, overlap, camera, placements, warnings."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of images, radar CSV, videos; several are read as one recording."""
    json: Switch = False
    """Print JSON instead of text."""
    verify: Switch = False
    """Read every message and check every checksum; exit code 1 if anything is damaged, lost or undecodable."""
    write: Switch = False
    """Write recording.toml beside the recording: its topics, clock and columns, which every command reads from then on."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Print the description; return the exit code."""
        import msgspec

        from calib_core.input_files import encodable
        from calib_core.recordings import describe, recording_summary

        if self.verify:
            return self._verify()
        with self.topics.open(self.recording, ()) as recording:
            if self.write:
                self._write(recording)
            if self.json:
                summary = encodable(msgspec.to_builtins(recording_summary(recording)))
                print(msgspec.json.format(msgspec.json.encode(summary), indent=2).decode())
            else:
                print(describe(recording), flush=True)
                if recording.radar_topics:
                    print(f"\nplacements  {_placements(recording)}")
        return 0

    def _write(self, recording: "Recording") -> None:
        """Write recording.toml, never over another one."""
        from calib_core.recordings.recording_file import recording_file_of, recording_file_text

        path = recording_file_of(self.recording[0])
        if path.exists():
            raise InputError(f"{path}: exists already; edit it, or move it away")
        chosen = replace(
            self.topics,
            radar_topic=",".join(recording.radar_topics) or None,
            image_topic=recording.image_topic,
            camera_info_topic=recording.camera_info_topic,
            map=recording.column_map,
        )
        write_whole(path, recording_file_text(chosen))
        print(f"written to {path}", file=sys.stderr)

    def _verify(self) -> int:
        import msgspec

        from calib_core.recordings import verification_text, verify_recording

        with (
            self.topics.open(self.recording, ()) as recording,
            progress_bar("reading everything") as progress,
        ):
            found = verify_recording(recording, progress=progress)
        print(
            msgspec.json.format(msgspec.json.encode(found), indent=2).decode()
            if self.json
            else verification_text(found)
        )
        return 0 if found.sound else 1


def _placements(recording: "Recording") -> str:
    """Say how many placements the radar shows, and what the recording is good for."""
    import numpy as np

    from calib_core.errors import CalibrationError
    from calib_core.options import GatingOptions
    from cocalib.web.channel.radar_survey import survey_of

    moments = recording.image_times
    try:
        if not len(moments):
            moments = np.concatenate([window.times_ns for window in recording.radar_windows()])
        return survey_of(recording.radar_windows(), moments, GatingOptions()).message.summary
    except CalibrationError as error:
        return f"unknown: {error}"
