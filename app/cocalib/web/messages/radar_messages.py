"""What is sent to a page about the radar alone: the placements, and, without a camera, its returns seen from above."""

from dataclasses import dataclass

import msgspec

from cocalib.view import Figure


@dataclass(frozen=True, slots=True)
class PlacementRow:
    """A placement found in the radar data.

    Attributes:
        start_s: since the first frame [s].
        end_s: since the first frame [s].
        frame: the frame to click in.
        range_m: of the reflector.
        score: 0 to 1.
        position_radar_m: (x, y, z).
        azimuth_deg: positive to the left.
        snr_db: mean of its returns; None if the radar has none.
        stands_out_db: above the strongest other static returns while it stood; None if unknown.
        note: what is unusual about it; "" if nothing is.
    """

    start_s: float
    end_s: float
    frame: int
    range_m: float
    score: float
    position_radar_m: tuple[float, float, float]
    azimuth_deg: float
    snr_db: float | None
    stands_out_db: float | None
    note: str = ""


@dataclass(frozen=True, slots=True)
class Placements:
    """The placements found from the radar alone.

    Attributes:
        placements: in order of time.
        summary: what they are good for, in one line; "" while unknown.
        figures: the same as figures.
    """

    placements: tuple[PlacementRow, ...]
    summary: str = ""
    figures: tuple[Figure, ...] = ()


class RadarReturn(msgspec.Struct, frozen=True, array_like=True):
    """One radar return seen from above; written as an array, since there are many.

    Attributes:
        x_m: forward.
        y_m: to the left.
        z_m: up.
        doppler_mps: positive moving away; None if the radar has none.
        snr_db: None if the radar has none.
        static: slow enough to be the reflector.
        age_s: how long before the shown moment.
    """

    x_m: float
    y_m: float
    z_m: float
    doppler_mps: float | None
    snr_db: float | None
    static: bool
    age_s: float


@dataclass(frozen=True, slots=True)
class RadarLook:
    """The returns of the last seconds, for a recording without pictures.

    Attributes:
        index: of the scan that is shown.
        returns: oldest first.
    """

    index: int
    returns: tuple[RadarReturn, ...]


@dataclass(frozen=True, slots=True)
class RadarMap:
    """Where the radar saw static returns during the whole recording: square cells seen from above, as columns.

    Attributes:
        cell_m: side of a cell.
        x_m: forward, of each cell's centre.
        y_m: to the left, of each cell's centre.
        z_m: mean height of its returns, upwards.
        share: of all scans that had a static return in the cell.
        snr_db: mean of these returns; empty if the radar has none.
        low_db: most static returns are stronger than this; None if the radar has none.
        high_db: few static returns are stronger than this.
    """

    cell_m: float
    x_m: tuple[float, ...]
    y_m: tuple[float, ...]
    z_m: tuple[float, ...]
    share: tuple[float, ...]
    snr_db: tuple[float, ...]
    low_db: float | None
    high_db: float | None
