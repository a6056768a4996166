"""`cocalib watch`: has something moved since the baseline?"""

import contextlib
import hashlib
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from time import sleep
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from calib_core.input_files import read_text
from cocalib.cli.exit_codes import DONE, IN_DOUBT, NO_ANSWER
from cocalib.cli.flags import INPUT, File, OutFile, Output, OutputFlags, Switch, called
from cocalib.cli.output import progress_bar
from cocalib.cli.recording_flags import Recordings, TopicFlags, Topics
from cocalib.cli.tree_flags import FrameFlags, Frames
from cocalib.platform.files import write_whole

if TYPE_CHECKING:
    from calib_core.interchange.format import ImportedCalibration
    from calib_core.recordings import Recording
    from calib_core.watching.baseline import Baseline
    from calib_core.watching.traffic import Watched
    from calib_core.watching.watching import Stretch
    from calib_core.watching.witnesses import Verdict

_MOST_BASELINE_BYTES = 16 * 1024 * 1024
_LOOK_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class Watch:
    """Watch whether camera or radar has turned since a baseline: by the still image, the still returns, and traffic."""

    calibration: Annotated[Path, tyro.conf.Positional, called("CALIBRATION")]
    """The calibration that is watched, in any format that import reads."""
    recording: Recordings
    """Bags (.bag, .mcap, .db3, folders), or folders of images, radar CSV, videos; several are read as one recording."""
    baseline: File = None
    """Compare with this baseline, or write it if there is none yet; by default CALIBRATION.baseline.json."""
    boxes: Annotated[str | None, called("FILE_OR_TOPIC"), INPUT] = None
    """Boxes around traffic, from a file or a topic, or the word moving: what moves before a fixed camera."""
    update: OutFile = None
    """Write the calibration carried forward by the change that was seen."""
    follow: Switch = False
    """Read a recording that is still being written (.bag, .mcap, .db3, folders) until it is complete."""
    json: Switch = False
    """Print a JSON object for each half minute and one at the end instead of text."""
    topics: Topics = field(default_factory=TopicFlags)
    frames: Frames = field(default_factory=FrameFlags)
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Print what has changed; return the exit code."""
        from calib_core.watching.traffic import Watched
        from cocalib.evaluation.recording_check import judged_calibration

        if not self.recording:
            raise InputError("RECORDING is missing; see cocalib watch --help")
        imported = self.frames.read([self.calibration])[0]
        if not self.calibration.is_file():
            raise InputError(f"{self.calibration}: is a folder; convert it to one file with cocalib import")
        digest = hashlib.sha256(self.calibration.read_bytes()).hexdigest()
        path = self.baseline or self.calibration.with_name(f"{self.calibration.stem}.baseline.json")
        baseline = self._read_baseline(path, digest) if path.exists() else None
        if baseline is None and self.update is not None:
            raise InputError(f"--update carries a change since a baseline, and there is no {path}; write one first")
        with self._opened() as (recording, grow):
            calibration = judged_calibration(imported, self.calibration, recording).calibration
            watched = Watched(calibration.camera_from_radar, calibration.camera, calibration.radar_errors)
            found = self._stretches(recording, watched, grow)
            if baseline is None:
                return self._write_baseline(path, digest, recording, watched, found)
            verdict = self._watch(baseline, watched, found)
        if self.update is not None:
            self._carry(imported, verdict, digest)
        return _exit_code(verdict)

    def _read_baseline(self, path: Path, digest: str) -> "Baseline":
        """Read the baseline.

        Raises:
            InputError: it is of another calibration.
        """
        from calib_core.watching.baseline import read_baseline

        text = read_text(path, max_bytes=_MOST_BASELINE_BYTES, is_what="a baseline")
        baseline = read_baseline(text, source=str(path))
        if baseline.calibration_sha256 != digest:
            raise InputError(
                f"{path}: is the baseline of another calibration ({baseline.calibration_sha256[:12]}..., this one's is "
                f"{digest[:12]}...); name another file with --baseline, which is then written"
            )
        return baseline

    @contextlib.contextmanager
    def _opened(self) -> "Iterator[tuple[Recording, Callable[[], bool] | None]]":
        """Open the recording; also yield what waits for more of it."""
        if not self.follow:
            with self.topics.open(self.recording, ("radar",)) as recording:
                yield recording, None
            return
        from calib_core.recordings import AwaitedRecording

        awaited = AwaitedRecording(self.recording, self.topics)
        try:
            while (followed := awaited.look()) is None:
                sleep(_LOOK_EVERY_S)
        except BaseException:
            awaited.close()
            raise

        def grow() -> bool:
            if not followed.is_complete and not followed.grow().messages:
                sleep(_LOOK_EVERY_S)
            return not followed.is_complete

        with followed:
            yield followed, grow

    def _stretches(
        self, recording: "Recording", watched: "Watched", grow: Callable[[], bool] | None
    ) -> "Iterator[Stretch]":
        """Yield what each half minute shows, with progress."""
        from calib_core.boxes import MOVING
        from calib_core.watching.watching import stretches
        from cocalib.evaluation.boxes import find_boxes

        moving = self.boxes == MOVING and not Path(MOVING).exists()
        if self.boxes is not None and not moving and grow is not None:
            raise InputError("--follow takes --boxes moving only: other boxes are not there yet")
        boxes = None if self.boxes is None or moving else find_boxes(self.boxes, recording)
        with progress_bar("watching") as progress:
            for stretch in stretches(recording, watched, boxes, moving=moving, grow=grow):
                first = int(recording.radar_times[0])
                progress(stretch.end - first, int(recording.radar_times[-1]) - first)
                yield stretch

    def _write_baseline(
        self, path: Path, digest: str, recording: "Recording", watched: "Watched", found: "Iterator[Stretch]"
    ) -> int:
        """Write the baseline of a first run, and say so."""
        from calib_core.watching.baseline import write_baseline
        from calib_core.watching.sentences import baseline_lines
        from calib_core.watching.watching import baseline_of

        baseline = baseline_of(list(found), calibration_sha256=digest, recording=recording.name, camera=watched.camera)
        write_whole(path, write_baseline(baseline))
        for line in (f"baseline written to {path}; the next recording is compared with it", *baseline_lines(baseline)):
            print(line, file=sys.stderr if self.json else sys.stdout)
        return IN_DOUBT

    def _watch(self, baseline: "Baseline", watched: "Watched", found: "Iterator[Stretch]") -> "Verdict":
        """Print what each stretch and all together say.

        Raises:
            InputError: nothing in the recording can be compared with the baseline.
        """
        from calib_core.watching.sentences import baseline_lines, json_line, verdict_lines
        from calib_core.watching.watching import Watch as Watching

        watching = Watching(baseline, watched)
        verdict = None
        for stretch in found:
            verdict = watching.add(stretch)
            if self.json:
                print(json_line(verdict, at=stretch.end), flush=True)
        if verdict is None:
            raise InputError(f"{self.recording[0]}: is shorter than five seconds; record for longer")
        if self.json:
            print(json_line(verdict, at=None, exit_code=_exit_code(verdict)))
        else:
            print("\n".join([*verdict_lines(verdict), *baseline_lines(baseline)]))
        return verdict

    def _carry(self, imported: "ImportedCalibration", verdict: "Verdict", digest: str) -> None:
        """Write the calibration carried forward.

        Raises:
            InputError: it is in another tool's format.
            NoAnswerError: no change was seen that can be carried.
        """
        from calib_core.interchange.own.calibration_json import write_calibration
        from calib_core.watching.carrying import carried_forward

        assert self.update is not None
        if imported.file is None:
            raise InputError(
                f"{self.calibration}: is {imported.format}; only calibration-1 is carried forward: convert it with cocalib import"
            )
        write_whole(self.update, write_calibration(carried_forward(imported.file, verdict, digest)))
        print(f"carried forward to {self.update}", file=sys.stderr if self.json else sys.stdout)


def _exit_code(verdict: "Verdict") -> int:
    from calib_core.watching.witnesses import HOLDS, SLIPPED

    return NO_ANSWER if verdict.finding in SLIPPED else DONE if verdict.finding in HOLDS else IN_DOUBT
