"""The user's options that change how plain files are read."""

from dataclasses import dataclass

from calib_core.recordings.column_map import MappedColumn

__all__ = ["PlainOptions"]


@dataclass(frozen=True, slots=True)
class PlainOptions:
    """Options of plain files.

    Attributes:
        video_start: the time of a video's first frame.
        mapped: --map, parsed.
        axes_given: whether the user gave --radar-axes.
        zone_s: offset from UTC of dates without a zone [s]; None if not given.
    """

    video_start: str | None = None
    mapped: tuple[MappedColumn, ...] = ()
    axes_given: bool = False
    zone_s: int | None = None
