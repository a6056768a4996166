"""Every format in one table. To add one: write its module, and add a line here."""

from collections.abc import Iterator
from difflib import get_close_matches

from calib_core.errors import InputError
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.apollo import APOLLO
from calib_core.interchange.formats.arrays.mat import MATLAB
from calib_core.interchange.formats.arrays.npz import NUMPY
from calib_core.interchange.formats.arrays.text_matrix import MATRIX
from calib_core.interchange.formats.autoware import AUTOWARE
from calib_core.interchange.formats.colmap import COLMAP
from calib_core.interchange.formats.driveworks import DRIVEWORKS
from calib_core.interchange.formats.foxglove import FOXGLOVE
from calib_core.interchange.formats.kalibr import KALIBR
from calib_core.interchange.formats.kitti import KITTI
from calib_core.interchange.formats.nuscenes import NUSCENES
from calib_core.interchange.formats.opencv import OPENCV
from calib_core.interchange.formats.pack.deployment_pack import PACK
from calib_core.interchange.formats.plugins import plugin_formats
from calib_core.interchange.formats.ros.launch_files import TF1_LAUNCH, TF2_LAUNCH_PY, TF2_LAUNCH_XML
from calib_core.interchange.formats.ros.tf2_command import TF2
from calib_core.interchange.formats.ros.urdf import URDF
from calib_core.interchange.own.calibration_format import CALIBRATION_1
from calib_core.interchange.own.truth_json import TRUTH

__all__ = ["FORMATS", "format_named", "readers", "written_formats"]

FORMATS: tuple[Format, ...] = (
    CALIBRATION_1,
    PACK,
    TF2,
    TF2_LAUNCH_PY,
    TF2_LAUNCH_XML,
    TF1_LAUNCH,
    URDF,
    AUTOWARE,
    APOLLO,
    KALIBR,
    OPENCV,
    KITTI,
    NUSCENES,
    DRIVEWORKS,
    FOXGLOVE,
    COLMAP,
    MATLAB,
    NUMPY,
    MATRIX,
)
"""Our formats that can be written, in display order."""

# Content is read as the first format that recognizes it. Most content fits only one, and the formats are tried in the
# order above; where two could fit, the more specific one is tried first.
_TRIED_FIRST = (
    *(CALIBRATION_1, TRUTH, DRIVEWORKS, FOXGLOVE, NUSCENES),  # JSON only; the next four may be JSON, too
    *(OPENCV, APOLLO, KALIBR, AUTOWARE),
    TF2_LAUNCH_PY,  # mentions the publisher, as TF2 does
)
_TRIED_LAST = (MATLAB, NUMPY)  # accept any mat file and any archive, to report what is wrong with it
_RESERVED = frozenset({"list", "all", TRUTH.name, *(known.name for known in FORMATS)})


def written_formats() -> tuple[Format, ...]:
    """Return every format that can be written: ours, then those of installed packages."""
    return tuple(_written())


def readers() -> Iterator[Reads]:
    """Yield the reader of each format in the order in which they are tried; packages come after most of ours."""
    ours = [known for known in FORMATS if known not in (*_TRIED_FIRST, *_TRIED_LAST)]
    yield from _reads(*_TRIED_FIRST, *ours)
    yield from _reads(*plugin_formats(_RESERVED), *_TRIED_LAST)


def format_named(name: str) -> Format:
    """Return a format that can be written by its name.

    Raises:
        InputError: there is no format of that name.
    """
    for known in _written():
        if known.name == name:
            return known
    names = [known.name for known in written_formats()]
    near = get_close_matches(name, names, n=1)
    raise InputError(
        f"unknown format {name!r}; did you mean {near[0]}?"
        if near
        else f"unknown format {name!r}; known: {', '.join(names)}"
    )


def _written() -> Iterator[Format]:
    yield from FORMATS
    yield from (added for added in plugin_formats(_RESERVED) if added.write is not None)


def _reads(*formats: Format) -> Iterator[Reads]:
    return (known.reads for known in formats if known.reads is not None)
