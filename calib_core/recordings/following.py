"""A recording that is still being written: it is opened once there is enough of it, and grows from then on.

Frames are only ever added at the end, so the index of a frame never changes. The choice of topics and clocks stays as it was made
at the beginning; if all the data lead to another choice, that is said once the recording is complete.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from calib_core.camera import Camera
from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S, DataWarning
from calib_core.recordings.assembly import Assembly, assemble
from calib_core.recordings.camera.image_stream import ImageStream
from calib_core.recordings.containers.following import FollowedFiles
from calib_core.recordings.recording import Recording
from calib_core.recordings.recording_file import RecordingFile, with_recording_file
from calib_core.recordings.selection import RecordingOptions

_ENOUGH_MESSAGES, _ENOUGH_S = 20, 3.0
"""With so many messages of each sensor, or messages over so many seconds, the clocks can be chosen."""


@dataclass(frozen=True, slots=True)
class Growth:
    """What has been added to a recording.

    Attributes:
        messages: complete messages of all topics that have been written since.
        frames: number of new frames.
        scans: number of new radar scans.
        completed: the writer has finished since.
    """

    messages: int = 0
    frames: int = 0
    scans: int = 0
    completed: bool = False


class AwaitedRecording:
    """Waits until there is enough of a recording to open it.

    Args:
        paths: files, which need not exist yet, and folders.
        options: topics and clock.

    Raises:
        RecordingError: one of the paths cannot be followed, or what a recording.toml beside them states is wrong.
    """

    def __init__(self, paths: Sequence[Path], options: RecordingOptions | None = None) -> None:
        self._paths = tuple(paths)
        self._options, self._file = with_recording_file(self._paths, options or RecordingOptions())
        self._files = FollowedFiles(self._paths)
        self._begun = 0
        self.missing = ""
        """What is being waited for, as a phrase."""

    def look(self) -> "FollowedRecording | None":
        """Open the recording if there is enough of it.

        Raises:
            RecordingError: it cannot be followed, or it is complete and lacks what is needed.
        """
        new = self._files.grow()
        if not self._files.sources:
            self.missing = f"{self._paths[0].name} has not been begun"
            return None
        complete, begun = self._files.is_complete, len(self._files.sources)
        if not (new or complete or begun > self._begun):
            return None
        self._begun = begun
        assembly = self._assembly(complete=complete)
        if assembly is None:
            return None
        return FollowedRecording(self._paths, self._files, assembly, self._options, self._file)

    def _assembly(self, *, complete: bool) -> Assembly | None:
        """Assemble what is there; None if it is not enough yet."""
        if complete:
            return assemble(self._paths, self._files.sources, self._options, ("radar", "image"))
        try:
            assembly = assemble(self._paths, self._files.sources, self._options, ())
        except RecordingError as error:
            self.missing = str(error)
            return None
        self.missing = _missing(assembly)
        return None if self.missing else assembly

    def close(self) -> None:
        """Close the files; not to be called once the recording is open."""
        self._files.close()


def _missing(assembly: Assembly) -> str:
    """Return what a recording lacks to be opened, as a phrase; "" if it has everything."""
    for what, stream in (("radar", assembly.radar), ("camera", assembly.images)):
        if stream is None:
            there = ", ".join(f"{topic.name} ({topic.type})" for topic in assembly.topics) or "none"
            return f"no {what} messages yet; topics so far: {there}"
        if len(stream.topic) < _ENOUGH_MESSAGES and np.ptp(stream.times_ns) < _ENOUGH_S * NS_PER_S:
            return f"less than {_ENOUGH_S:.0f} s of the {what} so far"
    assert assembly.radar is not None
    assert assembly.images is not None
    radar, images = assembly.radar.times_ns, assembly.images.times_ns
    apart = radar[0] > images[-1] or images[0] > radar[-1]
    return "radar and camera do not overlap in time yet" if apart else ""


class FollowedRecording(Recording):
    """A recording that is still being written. Created by AwaitedRecording.

    Reading is thread-safe, and `grow` may run in one thread meanwhile.

    Attributes:
        late: number of frames that came after a later one was shown; they are left out until the recording is opened again.
    """

    def __init__(
        self,
        paths: tuple[Path, ...],
        files: FollowedFiles,
        assembly: Assembly,
        options: RecordingOptions,
        file: RecordingFile | None,
    ) -> None:
        super().__init__(paths, files.sources, assembly, file=file)
        self._files = files
        self._options = replace(
            options,
            radar_topic=",".join(assembly.radar_topics),
            image_topic=assembly.image_topic,
            camera_info_topic=options.camera_info_topic,
        )
        self._of_the_end: tuple[DataWarning, ...] = ()
        self.late = 0
        self.is_complete = files.is_complete

    @property
    def warnings(self) -> tuple[DataWarning, ...]:
        """What the user must know, including what following has found."""
        return (*super().warnings, *self._late_warnings(), *self._of_the_end)

    def _late_warnings(self) -> tuple[DataWarning, ...]:
        if not self.late:
            return ()
        message = f"{self.late} frames of {self.image_topic} came later than frames with later stamps, and are left out"
        return (
            DataWarning.reported(
                "late-frames", message, "open the recording again once it is complete: it then has them"
            ),
        )

    def grow(self) -> Growth:
        """Take in what has been written since.

        Raises:
            RecordingError: the file was replaced, truncated or overwritten, or what follows in it cannot be read; what was
                read before stays readable if it is still there.
        """
        self._check_open()
        messages = self._files.grow()
        completed = self._files.is_complete and not self.is_complete
        if not messages and not completed:
            return Growth()
        self._fingerprint = ()
        frames, scans = len(self.image_times), len(self.radar_times)
        self.sources = self._files.sources
        if messages:
            self._take(assemble(self.paths, self.sources, self._options, (), self._assembly))
        if completed:
            self.is_complete = True
            self._conclude()
        return Growth(messages, len(self.image_times) - frames, len(self.radar_times) - scans, completed)

    def _take(self, assembly: Assembly) -> None:
        """Use the grown streams; the frames that were there keep their indices."""
        images, radar = assembly.images, assembly.radar
        assert images is not None
        assert radar is not None
        images, self.late = _only_added(self._assembly.images, images)
        self._assembly = replace(assembly, images=images)
        self.image_times, self.radar_times = images.times_ns, radar.times_ns

    def _conclude(self) -> None:
        """Judge the complete recording: its warnings, and whether its clocks would be chosen as they were."""
        whole = assemble(self.paths, self.sources, self._options, ())
        before = self._assembly
        if whole.clocks == before.clocks:
            self._assembly = replace(whole, images=before.images, radar=before.radar, camera=before.camera)
        else:
            self._of_the_end = (_other_clocks(before, whole),)
        self.topics = self._assembly.topics

    def camera(self) -> Camera | None:
        """Return the recorded intrinsics, as far as they were there when the recording was opened."""
        return self._assembly.camera


def _only_added(before: ImageStream | None, now: ImageStream) -> tuple[ImageStream, int]:
    """Leave out frames between earlier ones; return the stream and how many were left out."""
    if before is None or not len(before.times_ns):
        return now, 0
    count = len(before.times_ns)
    if len(now.times_ns) >= count and np.array_equal(now.times_ns[:count], before.times_ns):
        return now, 0
    kept = np.isin(now.times_ns, before.times_ns) | (now.times_ns > before.times_ns[-1])
    if np.count_nonzero(kept & (now.times_ns <= before.times_ns[-1])) < count:
        raise RecordingError(
            f"{now.topic.name}: the stamps of frames that were shown have changed; open the recording again"
        )
    return replace(now, times_ns=now.times_ns[kept], row=now.row[kept]), int(np.count_nonzero(~kept))


def _other_clocks(before: Assembly, whole: Assembly) -> DataWarning:
    names = sorted(name for name in whole.clocks if whole.clocks[name] != before.clocks.get(name))
    changes = ", ".join(f"{name} ({whole.clocks[name]} instead of {before.clocks.get(name)})" for name in names)
    return DataWarning.reported(
        "clock-chosen-early",
        f"with the whole recording, another clock would be chosen for {changes}",
        "the clicks are kept in the frames they were made in; give --clock header or --clock receive to open it in the same way",
    )
