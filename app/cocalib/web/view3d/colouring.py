"""What the colours of returns mean: static or moving, range, Doppler, SNR or height, each with a legend."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Values
from cocalib.colours import RETURN_RAMPS, STAYING, ramp_colours
from cocalib.web.messages import RadarMap, ReturnColour, SpaceLegend
from cocalib.web.view3d.extent import Extent
from cocalib.web.view3d.returns import Returns
from cocalib.web.view3d.shapes import DARK, LIGHT

_OLDEST_WEIGHT = 0.2
_BACKGROUND = {False: np.array([13, 16, 20]), True: np.array([233, 236, 240])}


@dataclass(frozen=True, slots=True)
class Colouring:
    """How returns are coloured in one 3D view.

    Attributes:
        colour: what the colours mean.
        extent: ends of the colours of range and height.
        snr_db: ends of the colours of amplitudes; None if the radar has none.
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
        low, high = (f"{end:+.0f}" if self.colour == "doppler" else f"{end:.{_decimals(scale)}f}" for end in scale)
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
            return self.extent.low_m, max(self.extent.high_m, self.extent.low_m + 0.1)
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


def _decimals(scale: tuple[float, float]) -> int:
    return 0 if scale[1] - scale[0] >= 10 else 1
