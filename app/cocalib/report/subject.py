"""What a report is about, as values: a calibration, and what a recording says of it."""

from dataclasses import dataclass

from calib_core.evaluation.figures import Evaluation
from calib_core.interchange.calibration_file import FrameNames
from calib_core.interchange.format import ImportedCalibration
from calib_core.measurements import ReflectorClick
from calib_core.results import Calibration, DataWarning, InputFile


@dataclass(frozen=True, slots=True)
class Image:
    """A frame to draw over.

    Attributes:
        jpeg: the frame, downscaled.
        words: which frame it is.
        returns_px: where the calibration puts the returns of the nearest scan, as pixels of the frame before downscaling.
    """

    jpeg: bytes
    words: str
    returns_px: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Watched:
    """A recording that the calibration is judged on.

    Attributes:
        name: of the recording.
        inputs: its files, by their content.
        topics: what was read from it, as (what, topic).
        warnings: of reading it.
        image: one of its frames; None if none can be read.
    """

    name: str
    inputs: tuple[InputFile, ...]
    topics: tuple[tuple[str, str], ...] = ()
    warnings: tuple[DataWarning, ...] = ()
    image: Image | None = None


@dataclass(frozen=True, slots=True)
class RecordingEvidence:
    """What a recording says of the calibration.

    Attributes:
        evaluation: the figures.
        clicks: that the residuals are at.
    """

    evaluation: Evaluation
    clicks: tuple[ReflectorClick, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class ReportSubject:
    """What a report is about.

    Attributes:
        name: of the calibration's file, without its folder.
        found: what was read.
        calibration: the same with a camera; None if no camera is known.
        version: of the program that writes the report.
        inputs: the files that it was read from, by their content.
        recording: that it is judged on.
        judged: what the recording says of it.
        required: the reader's limits, such as "max-deg=1".
    """

    name: str
    found: ImportedCalibration
    calibration: Calibration | None
    version: str
    inputs: tuple[InputFile, ...] = ()
    recording: Watched | None = None
    judged: RecordingEvidence | None = None
    required: tuple[str, ...] = ()

    @property
    def frames(self) -> FrameNames:
        """The names of the two frames; the usual ones if the file has none."""
        return self.found.frames or FrameNames()
