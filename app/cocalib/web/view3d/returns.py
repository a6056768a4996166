"""Radar returns of the 3D view: one scan or the last seconds, in clouds by size, and what their colours mean, with a legend."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Indices, Points3, Values
from cocalib.web.view3d.shapes import add_cloud, fill_cloud

if TYPE_CHECKING:
    import viser
from cocalib.colours import RETURN_RAMPS, STAYING, ramp_colours
from cocalib.web.messages.incoming import ReturnColour
from cocalib.web.messages.space_messages import RadarMap, SpaceLegend
from cocalib.web.radar_sight import Returns
from cocalib.web.view3d.extent import Extent
from cocalib.web.view3d.shapes import DARK, LIGHT

SIZES = (0.55, 0.75, 1.0, 1.35, 1.8)
"""Sizes of returns from weak to strong, relative to the middle one."""
_MIDDLE = len(SIZES) // 2


def size_classes(snr_db: Values, ends_db: tuple[float, float] | None) -> Indices:
    """Return the size class (n,) of each return, equal steps of amplitude; the middle one where it is not known.

    Args:
        snr_db: (n,).
        ends_db: amplitudes of the smallest and the largest; None if the radar has none.
    """
    if ends_db is None:
        return np.full(len(snr_db), _MIDDLE, dtype=np.int64)
    share = (snr_db - ends_db[0]) / max(ends_db[1] - ends_db[0], 1e-9)
    return np.where(np.isnan(share), _MIDDLE, np.clip(np.nan_to_num(share) * len(SIZES), 0, len(SIZES) - 1)).astype(
        np.int64
    )


class SizedClouds:
    """The nodes of viser that show returns: a cloud for each size class."""

    def __init__(self, scene: "viser.SceneApi", name: str) -> None:
        self._clouds = [add_cloud(scene, f"{name}_{number}", 0.12 * size) for number, size in enumerate(SIZES)]

    def resize(self, size_m: float) -> None:
        """Give the middle class a size."""
        for cloud, size in zip(self._clouds, SIZES, strict=True):
            cloud.point_size = size_m * size

    def fill(self, points_m: Points3, colours: np.ndarray, classes: Indices) -> None:
        """Draw returns.

        Args:
            points_m: (n, 3).
            colours: (n, 3).
            classes: (n,) of their sizes.
        """
        for number, cloud in enumerate(self._clouds):
            rows = classes == number
            fill_cloud(cloud, points_m[rows], colours[rows])


_OLDEST_WEIGHT = 0.2
_BACKGROUND = {False: np.array([13, 16, 20]), True: np.array([233, 236, 240])}


@dataclass(frozen=True, slots=True)
class Colouring:
    """How returns are coloured in one 3D view.

    Attributes:
        colour: what the colours mean.
        extent: of the data: ends of the colours of range and height.
        snr_db: ends of the sizes and colours of amplitudes; None if the radar has none.
        fastest_mps: end of the colours of Doppler.
        light: drawn on a light background.
    """

    colour: ReturnColour
    extent: Extent
    snr_db: tuple[float, float] | None
    fastest_mps: float
    light: bool

    def of(self, returns: Returns, trail_s: float) -> np.ndarray:
        """Return the colours (n, 3), nearer to the background the older a return is.

        Args:
            returns: to colour.
            trail_s: how long returns stay.
        """
        palette = LIGHT if self.light else DARK
        scale = self._scale()
        if scale is None:
            colours = np.where(returns.still[:, None], np.array(palette.still), np.array(palette.moving))
        else:
            values = {
                "range": returns.polar[:, 0],
                "doppler": returns.doppler_mps,
                "amplitude": returns.snr_db,
                "height": returns.points_m[:, 2],
            }[self.colour]
            colours = ramp_colours(values, *scale, signed=self.colour == "doppler", light=self.light)
        weight = 1.0 - (1.0 - _OLDEST_WEIGHT) * returns.age_s / max(trail_s, 1e-9)
        return _mixed(colours, np.clip(weight, _OLDEST_WEIGHT, 1.0), light=self.light)

    def legend(self) -> SpaceLegend:
        """Return what the colours mean, with units."""
        palette = LIGHT if self.light else DARK
        scale = self._scale()
        if scale is None:
            return SpaceLegend("", "static", "moving", (_css(palette.still), _css(palette.moving)), ramp=False)
        ramp = RETURN_RAMPS["signed" if self.colour == "doppler" else "rising", self.light]
        decimals = 0 if scale[1] - scale[0] >= 10 else 1
        low, high = (f"{end:+.0f}" if self.colour == "doppler" else f"{end:.{decimals}f}" for end in scale)
        unit = {"range": "m", "doppler": "m/s", "amplitude": "dB", "height": "m"}[self.colour]
        title = {"range": "Range", "doppler": "Doppler", "amplitude": "SNR", "height": "Height"}[self.colour]
        return SpaceLegend(title, low, f"{high} {unit}", tuple(map(_css, ramp)), ramp=True)

    def _scale(self) -> tuple[float, float] | None:
        """Return the values at both ends of the colours; None if returns are static or moving."""
        if self.colour == "range":
            return 0.0, self.extent.range_m
        if self.colour == "doppler":
            return -self.fastest_mps, self.fastest_mps
        if self.colour == "height":
            return self.extent.low_m, self.extent.high_m
        return self.snr_db if self.colour == "amplitude" else None


def map_colours(radar_map: RadarMap, colour: ReturnColour, *, light: bool) -> np.ndarray:
    """Return the colour (n, 3) of each cell: its amplitude, or the stronger the longer something was there."""
    if colour == "amplitude" and radar_map.low_db is not None and radar_map.high_db is not None:
        values = np.array(radar_map.snr_db)
        return np.rint(ramp_colours(values, radar_map.low_db, radar_map.high_db, light=light)).astype(np.uint8)
    share = np.clip(1.0 + np.log10(np.maximum(radar_map.share, 1e-9)) / 3.0, 0.15, 1.0)
    return _mixed(np.tile(STAYING[light], (len(share), 1)), share, light=light)


def _mixed(colours: np.ndarray, weight: Values, *, light: bool) -> np.ndarray:
    mixed = colours * weight[:, None] + _BACKGROUND[light] * (1.0 - weight[:, None])
    return np.rint(mixed).astype(np.uint8)


def _css(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
