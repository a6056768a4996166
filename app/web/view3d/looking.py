"""The 3D view of a recording without pictures: the returns of the last seconds, what stays, and the placements."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.web.messages import RadarMap, ReturnColour
from app.web.radar_sight import shown_rows
from app.web.view3d.nodes import add_cloud, add_lines, fill_cloud, fill_lines
from app.web.view3d.shapes import DARK, LIGHT, next_place
from calib_core.arrays import Values
from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.options import GatingOptions

if TYPE_CHECKING:
    import viser

__all__ = ["Look", "LookNodes", "amplitude_colours", "trail_colours"]

_MOST_LABELS = 60
_MOST_RETURNS = 20_000
_LABEL_ABOVE_M = np.array([0.0, 0.0, 0.3])
_OLDEST_WEIGHT = 0.2
_BACKGROUND = {False: np.array([13, 16, 20]), True: np.array([233, 236, 240])}
_WEAK_TO_STRONG = np.array(
    [[78, 66, 190], [150, 60, 180], [214, 82, 120], [246, 150, 70], [250, 226, 92]], dtype=np.float64
)
_WEAK_TO_STRONG_LIGHT = np.array(
    [[240, 190, 110], [226, 120, 86], [180, 56, 120], [112, 36, 140], [44, 12, 92]], dtype=np.float64
)
_STAYING = {False: (128, 146, 164), True: (96, 110, 126)}


@dataclass(frozen=True, slots=True, eq=False)
class Look:
    """What the 3D view shows of a recording without pictures.

    Attributes:
        time: the moment that is shown.
        trail: the scans of the last seconds before it.
        placements: found in the whole recording.
        map: of the static returns of the whole recording; None until it is known.
        whole: draw the map.
        colour: what the colours of returns mean.
    """

    time: TimeNs
    trail: RadarScans
    placements: Sequence[Placement]
    map: RadarMap | None
    whole: bool
    colour: ReturnColour


class LookNodes:
    """The nodes of viser that show a Look."""

    def __init__(self, scene: "viser.SceneApi") -> None:
        self._scene = scene
        self._trail = add_cloud(scene, "/trail", 0.12)
        self._map = add_cloud(scene, "/map", 0.1)
        self._rings = add_lines(scene, "/placements", 2.0, DARK.next)
        self._labels: list[Any] = []
        self._labelled: Sequence[Placement] = ()
        self._mapped: object = None

    def show(self, look: Look, options: GatingOptions, *, light: bool) -> None:
        """Draw a Look."""
        rows = shown_rows(look.trail, _MOST_RETURNS)
        fill_cloud(self._trail, look.trail.points_radar_m[rows], trail_colours(look, options, light=light)[rows])
        self._show_map(look, light=light)
        self._rings.colors = np.array((LIGHT if light else DARK).next, dtype=np.uint8)
        if look.placements is self._labelled:
            return
        self._labelled = look.placements
        places = np.array([placement.position_radar_m for placement in look.placements]).reshape(-1, 3)
        fill_lines(self._rings, next_place(places, radius_m=0.35))
        for label in self._labels:
            label.remove()
        self._labels = [
            self._scene.add_label(f"/placement_{number}", str(number), position=tuple(place), font_screen_scale=0.8)
            for number, place in enumerate(places[:_MOST_LABELS] + _LABEL_ABOVE_M, start=1)
        ]

    def _show_map(self, look: Look, *, light: bool) -> None:
        shown = (look.map, look.whole, look.colour, light)
        if shown == self._mapped:
            return
        self._mapped = shown
        if look.map is None or not look.whole:
            self._map.visible = False
            return
        points = np.stack([look.map.x_m, look.map.y_m, look.map.z_m], axis=1)
        fill_cloud(self._map, points, map_colours(look.map, look.colour, light=light))


def trail_colours(look: Look, options: GatingOptions, *, light: bool) -> np.ndarray:
    """Return the colour (n, 3) of each return of a trail, nearer to the background the older it is."""
    trail, palette = look.trail, LIGHT if light else DARK
    if look.colour == "amplitude" and look.map is not None and look.map.low_db is not None:
        colours = amplitude_colours(trail.snr_db, look.map, light=light)
    else:
        moving = np.abs(trail.doppler_mps) > options.max_speed_mps
        colours = np.where(moving[:, None], np.array(palette.moving), np.array(palette.still)).astype(np.float64)
    ages_s = (look.time - trail.times_ns[trail.scan_of_return()]) / NS_PER_S
    longest_s = (look.time - trail.times_ns[0]) / NS_PER_S if len(trail) else 0.0
    weight = 1.0 - (1.0 - _OLDEST_WEIGHT) * ages_s / max(longest_s, 1e-9)
    return _mixed(colours, weight, light=light)


def map_colours(radar_map: RadarMap, colour: ReturnColour, *, light: bool) -> np.ndarray:
    """Return the colour (n, 3) of each cell: its amplitude, or the stronger the longer something was there."""
    if colour == "amplitude" and radar_map.snr_db:
        return np.rint(amplitude_colours(np.array(radar_map.snr_db), radar_map, light=light)).astype(np.uint8)
    share = np.clip(1.0 + np.log10(np.maximum(radar_map.share, 1e-9)) / 3.0, 0.15, 1.0)
    return _mixed(np.tile(_STAYING[light], (len(share), 1)), share, light=light)


def amplitude_colours(snr_db: Values, radar_map: RadarMap, *, light: bool) -> np.ndarray:
    """Return the colour (n, 3) of amplitudes, from most returns to the strongest; grey where one is not known."""
    low_db, high_db = radar_map.low_db or 0.0, radar_map.high_db or 1.0
    ramp = _WEAK_TO_STRONG_LIGHT if light else _WEAK_TO_STRONG
    share = np.clip((snr_db - low_db) / max(high_db - low_db, 1e-9), 0.0, 1.0)
    colours = np.stack([np.interp(share, np.linspace(0, 1, len(ramp)), channel) for channel in ramp.T], axis=1)
    colours[np.isnan(snr_db)] = _STAYING[light]
    return colours


def _mixed(colours: np.ndarray, weight: Values, *, light: bool) -> np.ndarray:
    mixed = colours * weight[:, None] + _BACKGROUND[light] * (1.0 - weight[:, None])
    return np.rint(mixed).astype(np.uint8)
