"""The user's options that change how plain files are read."""

from dataclasses import dataclass
from pathlib import Path

from calib_core.recordings.column_map import MappedColumn


@dataclass(frozen=True, slots=True)
class PlainOptions:
    """Options of plain files.

    Attributes:
        video_start: the time of a video's first frame.
        mapped: --map, parsed.
        axes_given: whether the user gave the directions of --radar-axes.
        angle_unit: the angle unit of --radar-axes, "deg" or "rad"; "" if not given.
        zone_s: offset from UTC of dates without a zone [s]; None if not given.
        taken: files that are read as something else already.
    """

    video_start: str | None = None
    mapped: tuple[MappedColumn, ...] = ()
    axes_given: bool = False
    angle_unit: str = ""
    zone_s: int | None = None
    taken: frozenset[Path] = frozenset()
