"""Flags that describe a calibration board."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import called

if TYPE_CHECKING:
    from calib_core.intrinsics import Board


@dataclass(frozen=True, slots=True)
class BoardFlags:
    """Which calibration board is in the pictures."""

    board: Annotated[str | None, called("COLUMNSxROWS")] = None
    """Size of the board: inner corners of a checkerboard (9x6 for 10 x 7 squares), squares of a ChArUco board, tags of a grid."""
    square_mm: Annotated[float | None, called("MM")] = None
    """Side of a square, or of a tag of an AprilGrid [mm]."""
    kind: Literal["checkerboard", "charuco", "aprilgrid"] = "checkerboard"
    """Kind of board."""
    marker_mm: Annotated[float | None, called("MM")] = None
    """Side of a marker of a ChArUco board [mm]; three quarters of a square if not given."""
    dictionary: Annotated[str | None, called("NAME")] = None
    """Markers as OpenCV names them; DICT_5X5_250 for ChArUco and DICT_APRILTAG_36h11 for an AprilGrid if not given."""
    tag_spacing: Annotated[float | None, called("RATIO")] = None
    """Gap between the tags of an AprilGrid, as a share of a tag's side (Kalibr's tagSpacing); 0.3 if not given."""

    def required(self) -> "Board":
        """Return the board.

        Raises:
            InputError: something about it is missing, or does not apply to this kind.
        """
        from calib_core.intrinsics import board_of_size

        if self.board is None or self.square_mm is None:
            missing = " and ".join(
                flag
                for flag, value in (("--board 9x6", self.board), ("--square-mm 25", self.square_mm))
                if value is None
            )
            raise InputError(
                f"which board is in the pictures is not said: give {missing} "
                "(a checkerboard of 10 x 7 squares has 9x6 inner corners)"
            )
        return board_of_size(
            self.board,
            self.square_mm,
            self.kind,
            marker_mm=self.marker_mm,
            tag_spacing=self.tag_spacing,
            dictionary=self.dictionary,
        )


BoardUsed: TypeAlias = Annotated[BoardFlags, tyro.conf.arg(name="")]
