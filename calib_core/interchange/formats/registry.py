"""Every format in one table. To add one: write its module, and add a line here.

Formats of other installed packages (entry points cocalib.formats) are checked when loaded and guarded when called.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from calib_core.errors import CalibrationError, InputError, meant
from calib_core.interchange.format import Format, ImportedCalibration, Reads
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
from calib_core.plugins import Plugin, load_plugins, warn_skipped

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
_RESERVED = frozenset({"list", "all", TRUTH.name, *(known.name for known in (*FORMATS, *CAMERA_ONLY))})


def written_formats() -> tuple[Format, ...]:
    """Return every format that can be written: ours, then those of installed packages."""
    return tuple(_written())


def readers() -> Iterator[Reads]:
    """Yield the reader of each format in the order in which they are tried; packages come after most of ours."""
    others = [known for known in FORMATS if known not in (*_OURS, *_TRIED_FIRST, MATLAB)]
    yield from _reads(*_OURS)
    yield from _ONLY_READ
    yield from _reads(*_TRIED_FIRST, *others)
    yield from _reads(*plugin_formats(_RESERVED), MATLAB)
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
    for known in _written():
        if known.name == name:
            return known
    names = [known.name for known in written_formats()]
    raise InputError(f"unknown format {name!r}; {meant(_OTHER_NAMES.get(name, name), names)}")


def _written() -> Iterator[Format]:
    yield from FORMATS
    yield from CAMERA_ONLY
    yield from (added for added in plugin_formats(_RESERVED) if added.write is not None)


def _reads(*formats: Format) -> Iterator[Reads]:
    return (known.reads for known in formats if known.reads is not None)


GROUP = "cocalib.formats"
_NAME = re.compile(r"[a-z0-9]+(-[a-z0-9]+)*")


@cache
def plugin_formats(reserved: frozenset[str]) -> tuple[Format, ...]:
    """Return the formats that installed packages add, loaded once, on first use.

    Args:
        reserved: names that are already taken.
    """
    taken = set(reserved)
    formats = []
    for plugin in load_plugins(GROUP, Format):
        name = plugin.value.name
        if not _NAME.fullmatch(name):
            warn_skipped(plugin.distribution, f"the format name {name!r} may contain only a-z, 0-9 and single hyphens")
        elif name in taken:
            warn_skipped(plugin.distribution, f"the format name {name!r} is already taken")
        else:
            taken.add(name)
            formats.append(_guarded(plugin))
    return tuple(formats)


def _guarded(plugin: Plugin[Format]) -> Format:
    """Return a format whose functions fail with an error that names the package."""
    added = plugin.value
    owner = f"the format {added.name} of the package {plugin.distribution}"

    def guard(call: Any, returns: type | tuple[type, ...]) -> Any:
        return None if call is None else _Guarded(owner, call, returns)

    reads = added.reads
    return replace(
        added,
        write=guard(added.write, (str, bytes)),
        write_in_parent=guard(added.write_in_parent, (str, bytes)),
        reads=reads
        and Reads(
            _GuardedRecognizer(plugin.distribution, reads.recognizes),
            guard(reads.read, ImportedCalibration),
            reads.beside,
        ),
    )


@dataclass(frozen=True, slots=True)
class _Guarded:
    """A function of a package; what it raises, or returns with the wrong type, becomes an InputError."""

    owner: str
    call: Callable[..., Any]
    returns: type | tuple[type, ...]

    def __call__(self, *arguments: Any) -> Any:
        try:
            result = self.call(*arguments)
        except CalibrationError:
            raise
        except Exception as error:  # a package's code may raise anything
            raise InputError(
                f"{self.owner} failed ({type(error).__name__}: {error}); report it to its authors"
            ) from error
        if not isinstance(result, self.returns):
            raise InputError(f"{self.owner} failed (it returned {type(result).__name__}); report it to its authors")
        return result


@dataclass(frozen=True, slots=True)
class _GuardedRecognizer:
    """A package's recognizer; if it fails, the file counts as not recognized."""

    distribution: str
    call: Callable[[Content], bool]

    def __call__(self, content: Content) -> bool:
        try:
            return bool(self.call(content))
        except Exception as error:  # noqa: BLE001  the same
            warn_skipped(self.distribution, f"its recognizer failed ({type(error).__name__}: {error})")
            return False
