"""`cocalib info`: show what is in a recording."""

from dataclasses import dataclass, field

from cocalib.cli.flags import Switch
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recordings, TopicFlags, Topics


@dataclass(frozen=True, slots=True)
class Info:
    """Show what a recording contains: files, topics, types, rates, stamps, overlap, camera, warnings."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
    json: Switch = False
    """Print JSON instead of text."""
    verify: Switch = False
    """Read every message and check every checksum; exit code 1 if anything is damaged, lost or undecodable."""
    decode_pictures: Switch = False
    """With --verify, decode every picture; otherwise only its first and last bytes are looked at."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Print the description; return the exit code."""
        import msgspec

        from calib_core.input_files import encodable
        from calib_core.recordings import describe, inspect_recording, recording_summary

        if self.verify:
            return self._verify()
        with inspect_recording(self.recording, self.topics) as recording:
            if self.json:
                summary = encodable(msgspec.to_builtins(recording_summary(recording)))
                print(msgspec.json.format(msgspec.json.encode(summary), indent=2).decode())
            else:
                print(describe(recording))
        return 0

    def _verify(self) -> int:
        import msgspec

        from calib_core.recordings import inspect_recording, verification_text, verify_recording

        with (
            inspect_recording(self.recording, self.topics) as recording,
            progress_bar("reading everything") as progress,
        ):
            found = verify_recording(recording, decode_pictures=self.decode_pictures, progress=progress)
        print(
            msgspec.json.format(msgspec.json.encode(found), indent=2).decode()
            if self.json
            else verification_text(found)
        )
        return 0 if found.sound else 1
