"""What is sent to a page of the 3D view, of the placements, and of the radar seen from above where there is no camera."""

from dataclasses import dataclass
from typing import Literal

import msgspec

from cocalib.view.model import Figure, PlacementState


class RadarReturn(msgspec.Struct, frozen=True, array_like=True):
    """One radar return; written as an array, since there are many.

    Attributes:
        u_px: column in the image; None or NaN if it is not in it, or without a calibration.
        v_px: row in the image.
        range_m: as the radar reports it.
        doppler_mps: positive moving away; None or NaN if the radar has none.
        snr_db: None or NaN if the radar has none.
        static: slow enough to be the reflector.
        x_m: forward, where it is drawn: the radar's estimated errors are taken out.
        y_m: to the left.
        z_m: up.
        age_s: how long before the shown moment.
        azimuth_deg: as the radar reports it, positive to the left.
        elevation_deg: positive upwards.
    """

    u_px: float | None
    v_px: float | None
    range_m: float
    doppler_mps: float | None
    snr_db: float | None
    static: bool
    x_m: float
    y_m: float
    z_m: float
    age_s: float
    azimuth_deg: float
    elevation_deg: float


class SpaceReturn(msgspec.Struct, frozen=True, array_like=True):
    """A return of the 3D view, which can be picked; written as an array.

    Attributes:
        seen: what the radar reports, and where it is.
        colour: as it is drawn, "#rrggbb".
        size: as it is drawn, relative to the middle size.
    """

    seen: RadarReturn
    colour: str
    size: float


@dataclass(frozen=True, slots=True)
class SpaceReflector:
    """The true position of a pair's reflector, as estimated.

    Attributes:
        id: of the click.
        position_m: (x, y, z).
        pixel_px: (u, v) in the image; None if it is not in it.
    """

    id: str
    position_m: tuple[float, float, float]
    pixel_px: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class SpacePlacement:
    """A placement, in the order of the message about placements.

    Attributes:
        position_m: (x, y, z) where it is drawn.
        pixel_px: (u, v) in the image; None if it is not in it, or without a calibration.
        state: what became of it.
    """

    position_m: tuple[float, float, float]
    pixel_px: tuple[float, float] | None
    state: PlacementState


@dataclass(frozen=True, slots=True)
class SpaceLabel:
    """Words at a point.

    Attributes:
        words: to write.
        position_m: (x, y, z).
        kind: what it is about.
    """

    words: str
    position_m: tuple[float, float, float]
    kind: Literal["selected", "next", "camera"]


@dataclass(frozen=True, slots=True)
class SpaceLegend:
    """What the colours of returns mean.

    Attributes:
        title: the quantity; "" if returns are static or moving.
        low: words for the first colour.
        high: words for the last colour, with the unit.
        colours: "#rrggbb" each.
        ramp: they go over into each other.
    """

    title: str
    low: str
    high: str
    colours: tuple[str, ...]
    ramp: bool


@dataclass(frozen=True, slots=True)
class SpaceFrame:
    """What the 3D view shows, for the layer that the page draws over it.

    Attributes:
        number: rises by one with every drawing of the 3D view, whose node "/shown" carries the same number.
        index: of the frame.
        returns: of the scan, or of the last seconds.
        window: static returns around the selected click.
        reflectors: of the pairs.
        placements: of the recording.
        labels: to write in the view.
        rings_m: ranges of the rings.
        ground_m: height of the rings.
        range_m: how far the data reach.
        legend: of the colours.
        projected: whether there is a calibration that says where things are in the image.
    """

    number: int
    index: int
    returns: tuple[SpaceReturn, ...]
    window: tuple[SpaceReturn, ...]
    reflectors: tuple[SpaceReflector, ...]
    placements: tuple[SpacePlacement, ...]
    labels: tuple[SpaceLabel, ...]
    rings_m: tuple[float, ...]
    ground_m: float
    range_m: float
    legend: SpaceLegend
    projected: bool


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


@dataclass(frozen=True, slots=True)
class RadarFrame:
    """The returns of the last seconds, for a recording without images.

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
