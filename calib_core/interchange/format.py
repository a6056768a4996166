"""A calibration file format: its name, what its numbers mean, its writer and its reader."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from calib_core.geometry import RigidTransform
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.syntax.content import Content

Comment = Literal["#", "<!-- -->", "keys", "numbers", "none"]
CameraShare = Literal["none", "matrix", "lens"]
"""How much of the camera a format stores: nothing, its matrix without distortion, or the whole lens."""


@dataclass(frozen=True, slots=True)
class Reads:
    """How a format is read.

    Attributes:
        recognizes: returns whether a file's content is of this format; raises nothing.
        read: returns the calibration in recognized content, given the name of the file for error messages; raises
            InputError if the content is invalid.
        beside: names of files that complete one, if they are in the same folder; they arrive in `Content.beside`.
    """

    recognizes: Callable[[Content], bool]
    read: Callable[[Content, str], ImportedCalibration]
    beside: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One format of calibration files.

    Attributes:
        name: the value of `--to`.
        title: a one-line description.
        numbers: what the numbers in the file mean, in one line: the direction of the transform and the order of the numbers.
        file_name: the default file name.
        camera: how much of the camera it stores.
        comment: where it states its frames and check point: in comments ("#", "<!-- -->"), in keys of its own, as
            numbers without the frames (in formats that hold nothing else), or nowhere.
        write: returns the file content for a calibration; raises InputError for what the format cannot represent. None
            if the format can only be read.
        reads: how it is recognized and read; None if the format can only be written.
        notes: what a user of the file must know, one sentence each.
        write_in_parent: like write, with a given pose of the radar in a third frame (kit, ego); None if it has none.
        used_in: where its files are used: the heading in lists.
        also: other words that someone may search for.
        notes_on: returns more notes, which depend on the calibration; None if there are none.
        holds_angle_map: it stores the radar's angle map.
        is_unpacked: it is a zip archive whose files are meant to be unpacked: written into a folder, if one is given.
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
    used_in: str = "Other tools"
    also: str = ""
    notes_on: Callable[[CalibrationFile], tuple[str, ...]] | None = None
    holds_angle_map: bool = False
    is_unpacked: bool = False

    @property
    def is_for_rectified(self) -> bool:
        """Whether its pictures must be rectified: it stores a camera matrix but no distortion."""
        return self.camera == "matrix"
