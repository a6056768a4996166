"""What a picture of a board suffers: blur, noise, light, a bent board, squares that are not equal, and a rolling shutter."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class BoardShape:
    """How a board differs from the ideal one; the same in every picture.

    Attributes:
        bend_m: how far its middle stands behind its sides, and behind its upper and lower edge: a quadratic bend [m].
        scale: size of the squares along x and y over the stated one.
        unequal_m: standard deviation of where each line between squares is printed [m].
        seed: of these lines.
    """

    bend_m: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    unequal_m: float = 0.0
    seed: int = 0


@dataclass(frozen=True, slots=True)
class BoardFilm:
    """How a board is filmed.

    Attributes:
        shape: of the board.
        blur_px: standard deviation of the lens blur [px].
        noise_grey: standard deviation of the sensor's noise [grey levels], the same in all three channels.
        exposure: brightness over the usual one.
        gradient: by how much brighter than in the middle the light is at the right and at the lower border, as a share.
        vignetting: share of the light that is missing in the corners.
        black_grey, white_grey: levels of the board's ink and paper.
        velocity_mps: (3,) of the board's middle, in the camera frame.
        turning_radps: (3,) the board's rotation vector per second, in the camera frame.
        rolling_shutter_s: from the exposure of the first row to that of the last; the pose is that at the middle row.
        exposure_s: how long each row is exposed.
    """

    shape: BoardShape = BoardShape()
    blur_px: float = 0.0
    noise_grey: float = 0.0
    exposure: float = 1.0
    gradient: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.0
    black_grey: float = 35.0
    white_grey: float = 205.0
    velocity_mps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turning_radps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rolling_shutter_s: float = 0.0
    exposure_s: float = 0.0
