"""`cocalib video`: write a recording's camera frames to a video file."""

from dataclasses import dataclass, field

from app.cli.flags import NewFile
from app.cli.output import progress_bar, seconds_text
from app.cli.recording_flags import Recordings, TopicFlags, Topics

__all__ = ["Video"]


@dataclass(frozen=True, slots=True)
class Video:
    """Write the camera's frames to a video, each at its recorded time; recorded JPEG is not re-encoded."""

    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of pictures, radar CSV, videos; several are read as one recording."""
    out: NewFile
    """Output video: .mp4 or .mov (times to a microsecond), or .mkv (to a millisecond)."""
    topics: Topics = field(default_factory=TopicFlags)

    def run(self) -> int:
        """Write the video; return the exit code."""
        from calib_core.recordings import open_recording, write_video

        with (
            open_recording(self.recording, self.topics, require=("image",)) as recording,
            progress_bar("writing frames") as progress,
        ):
            written = write_video(recording, self.out, progress=progress)
        print(f"{self.out}: {written.frames} frames, {written.duration_s:.3f} s, from {seconds_text(written.start)}")
        for warning in recording.warnings:
            if warning.code in ("picture-sizes", "unreadable-pictures"):
                print(f"{warning.message}")
        if written.other_size:
            print(f"{written.other_size} frames are left out: their size differs from the first frame's")
        if written.unreadable:
            print(f"{written.unreadable} frames are left out because they cannot be read: {written.fault}")
        return 0
