"""Every format in one table. To add one: write its module, and add a line here."""

from collections.abc import Iterator

from calib_core.errors import InputError, meant
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.apollo import APOLLO
from calib_core.interchange.formats.autoware import AUTOWARE
from calib_core.interchange.formats.autoware_ai import AUTOWARE_AI
from calib_core.interchange.formats.camera_info import CAMERA_INFO
from calib_core.interchange.formats.colmap import COLMAP
from calib_core.interchange.formats.driveworks import DRIVEWORKS
from calib_core.interchange.formats.kalibr import KALIBR
from calib_core.interchange.formats.kitti import KITTI
from calib_core.interchange.formats.kitti_raw import KITTI_ODOMETRY, KITTI_RAW
from calib_core.interchange.formats.koide3 import KOIDE3
from calib_core.interchange.formats.mat import MATLAB
from calib_core.interchange.formats.named_arrays import NUMPY
from calib_core.interchange.formats.not_between_both import K_RADAR_CAMERA, K_RADAR_OFFSET, KALIBR_CHAIN, KITTI_CAMERAS
from calib_core.interchange.formats.nuscenes import NUSCENES
from calib_core.interchange.formats.opencv import OPENCV
from calib_core.interchange.formats.pjlab import PJLAB
from calib_core.interchange.formats.static_transform import TF2, TF2_LAUNCH_PY
from calib_core.interchange.formats.text_matrix import MATRIX
from calib_core.interchange.formats.urdf import URDF
from calib_core.interchange.own.calibration_json import CALIBRATION_1
from calib_core.interchange.own.truth_json import TRUTH
from calib_core.interchange.syntax.content import Content
from calib_core.interchange.trees.posed_in_tree import read_joints
from calib_core.interchange.trees.reading import JOINTS

FORMATS: tuple[Format, ...] = (
    CALIBRATION_1,
    TF2,
    TF2_LAUNCH_PY,
    URDF,
    AUTOWARE,
    APOLLO,
    KALIBR,
    OPENCV,
    KITTI,
    NUSCENES,
    DRIVEWORKS,
    PJLAB,
    COLMAP,
    MATLAB,
    MATRIX,
)
"""Our formats that can be written and read, in display order."""

CAMERA_ONLY: tuple[Format, ...] = (CAMERA_INFO,)
"""Formats of the camera without the pose: written after FORMATS, and not read as a calibration."""

# Content is read as the first format that recognizes it: ours name their schema and are asked first. Most content fits only
# one, and the formats are tried in the order above; where two could fit, the more specific one is tried first.
_OURS = (CALIBRATION_1, TRUTH)
_TRIED_FIRST = (
    *(PJLAB, DRIVEWORKS),  # JSON only
    NUSCENES,  # takes any JSON list
    *(OPENCV, APOLLO, KALIBR, AUTOWARE),  # YAML, JSON or FileStorage
)
# Formats that are only read; each is recognized by keys or lines that no other tool writes.
_ONLY_READ = (
    *(AUTOWARE_AI, KITTI_RAW, KITTI_ODOMETRY, KOIDE3),
    Reads(lambda content: any(recognizes(content) for recognizes, _ in JOINTS), read_joints),
    *(KALIBR_CHAIN, KITTI_CAMERAS, K_RADAR_CAMERA, K_RADAR_OFFSET),  # refused in words
)


def written_formats() -> tuple[Format, ...]:
    """Return every format that can be written."""
    return (*FORMATS, *CAMERA_ONLY)


def readers() -> Iterator[Reads]:
    """Yield the reader of each format in the order in which they are tried."""
    others = [known for known in FORMATS if known not in (*_OURS, *_TRIED_FIRST, MATLAB)]
    yield from _reads(*_OURS)
    yield from _ONLY_READ
    yield from _reads(*_TRIED_FIRST, *others, MATLAB)
    yield NUMPY  # accepts any archive, as MATLAB does any mat file, to report what is wrong with it


def reader_of(content: Content) -> Reads | None:
    """Return the reader of the first format that recognizes content; None if there is none."""
    return next((reader for reader in readers() if reader.recognizes(content)), None)


def is_ours(reader: Reads | None) -> bool:
    """Return whether a reader is of a format that names our schema."""
    return reader is not None and reader in tuple(_reads(*_OURS))


_OTHER_NAMES = {"ros": "tf2", "ros1": "tf2", "ros2": "tf2", "tf": "tf2"}
"""What people call a format, and its name."""


def format_named(name: str) -> Format:
    """Return a format that can be written by its name.

    Raises:
        InputError: there is no format of that name.
    """
    known = {known.name: known for known in written_formats()}
    if name not in known:
        raise InputError(f"unknown format {name!r}; {meant(_OTHER_NAMES.get(name, name), list(known))}")
    return known[name]


def _reads(*formats: Format) -> Iterator[Reads]:
    return (known.reads for known in formats if known.reads is not None)
