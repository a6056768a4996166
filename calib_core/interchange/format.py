"""What a format is to us: its name, what its numbers are, the writer, and the reader beside it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.syntax.content import Content

__all__ = ["CameraShare", "Comment", "Format", "Reads"]

Comment = Literal["#", "<!-- -->", "keys", "none"]
CameraShare = Literal["none", "matrix", "lens"]
"""What of the camera a format carries: nothing, its matrix with no place for distortion, or the whole lens."""


@dataclass(frozen=True, slots=True)
class Reads:
    """How a format is read.

    Attributes:
        recognizes: tells from a file's content whether it is of this format; it raises nothing.
        read: returns the calibration in content that was recognized, given what to call the file in an error; raises
            InputError where the content is wrong.
    """

    recognizes: Callable[[Content], bool]
    read: Callable[[Content, str], ImportedCalibration]


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One format of calibration files.

    Attributes:
        name: what `--to` takes.
        title: one line for people.
        numbers: what the file's numbers are, in one line: which way they carry points, and in which order they stand.
        file_name: what the file is called unless a person says otherwise.
        camera: what of the camera is in it too.
        comment: how it says its frames and check point in words: "#", "<!-- -->", its own keys, or none.
        write: turns a calibration into the file's content; refuses in words what the format cannot carry. None where
            the format is only read.
        reads: how it is recognized and read; None where the format is only written.
        notes: what a person must know who uses it, one sentence each.
        write_in_parent: the same under a known pose of the radar in a third frame (kit, ego); None where there is none.
    """

    name: str
    title: str
    numbers: str
    file_name: str
    camera: CameraShare
    comment: Comment
    write: Callable[[CalibrationFile], str | bytes] | None
    reads: Reads | None
    notes: tuple[str, ...] = ()
    write_in_parent: Callable[[CalibrationFile, RigidTransform], str | bytes] | None = None

    @property
    def is_for_rectified(self) -> bool:
        """Whether its pictures must be rectified: it carries a camera matrix and has no place for distortion."""
        return self.camera == "matrix"
