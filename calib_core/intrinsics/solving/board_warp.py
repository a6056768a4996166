"""Shapes that a board can have instead of the stated one: bent along either side, twisted, or printed too long."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, frozen_array


@dataclass(frozen=True, slots=True, eq=False)
class BoardWarp:
    """Ways in which the corners of a board may be off their places.

    Attributes:
        names: (s,) of the amounts: "bend along the rows" and so on.
        directions: (s, n, 3) how far each corner moves for an amount of one, by id [m].
    """

    names: tuple[str, ...]
    directions: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "directions", frozen_array(self.directions, (len(self.names), None, 3)))

    def __len__(self) -> int:
        return len(self.names)

    def displacements_m(self, corner_ids: np.ndarray) -> np.ndarray:
        """Return how corners (v, m) move for amounts of one: (v, s, 3, m)."""
        return np.asarray(np.moveaxis(self.directions[:, corner_ids], (0, 3), (1, 2)))

    def shape_m(self, board_m: Points3, amounts: np.ndarray) -> Points3:
        """Return the corners (n, 3) of a board that is warped by amounts (s,)."""
        return board_m + np.tensordot(amounts, self.directions, axes=1) if len(self) else board_m


FLAT = BoardWarp((), np.zeros((0, 1, 3)))
"""The board is as stated."""


def possible_warps(board_m: Points3) -> BoardWarp:
    """Return the warps that are looked for.

    The first three amounts are heights [m]: of the middle over the ends along the rows and along the columns, positive
    where the middle lies deeper in the board, and of the twist at a corner of the board. The last is by how much the
    rows are longer than stated, with the columns as stated.

    Args:
        board_m: (n, 3) corners of the board as stated, by id.
    """
    low, high = board_m[:, :2].min(axis=0), board_m[:, :2].max(axis=0)
    across, down = ((2.0 * board_m[:, :2] - low - high) / (high - low)).T
    directions = np.zeros((4, len(board_m), 3))
    directions[0, :, 2], directions[1, :, 2], directions[2, :, 2] = 1.0 - across**2, 1.0 - down**2, across * down
    directions[3, :, 0] = board_m[:, 0] - (low[0] + high[0]) / 2.0
    return BoardWarp(("bend along the rows", "bend along the columns", "twist", "stretch of the rows"), directions)
