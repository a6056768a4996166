"""What the 3D view shows of the whole recording: the static returns at any time, and the placements."""

from typing import TYPE_CHECKING

import numpy as np

from cocalib.web.messages import PlacementState
from cocalib.web.view3d.colouring import map_colours
from cocalib.web.view3d.nodes import add_cloud, add_lines, fill_cloud, fill_lines
from cocalib.web.view3d.shapes import DARK, LIGHT, next_place
from cocalib.web.view3d.sight import Sight

if TYPE_CHECKING:
    import viser

_RING_SHARE = 0.025
"""Radius of a placement's ring, as a share of the extent."""


class SurveyNodes:
    """The nodes of viser that show what is known of the whole recording; filled again only when that changes."""

    def __init__(self, scene: "viser.SceneApi") -> None:
        self._map = add_cloud(scene, "/map", 0.1)
        self._rings = {
            state: add_lines(scene, f"/placements_{state}", width_px, DARK.next)
            for state, width_px in (("open", 2.0), ("clicked", 1.0))
        }
        self._mapped: object = None
        self._placed: object = None

    def show(self, sight: Sight) -> None:
        """Draw the map and the placements of a Sight."""
        self._show_map(sight)
        states, palette = sight.placement_states(), LIGHT if sight.light else DARK
        placed = (tuple(map(id, sight.placements)), states, sight.extent, sight.light, id(sight.calibration))
        if placed == self._placed:
            return
        self._placed = placed
        positions = np.array([placement.position_radar_m for placement in sight.placements]).reshape(-1, 3)
        places = sight.errors.corrected(positions)
        colours: dict[PlacementState, tuple[int, int, int]] = {"open": palette.next, "clicked": palette.rings}
        for state, rings in self._rings.items():
            chosen = np.array([one == state for one in states], dtype=bool)
            rings.colors = np.array(colours[state], dtype=np.uint8)  # type: ignore[index]
            fill_lines(rings, next_place(places[chosen], radius_m=max(0.15, _RING_SHARE * sight.extent.range_m)))

    def _show_map(self, sight: Sight) -> None:
        shown = (sight.map, sight.colour, sight.light)
        if shown == self._mapped:
            return
        self._mapped = shown
        if sight.map is None:
            self._map.visible = False
            return
        points = np.stack([sight.map.x_m, sight.map.y_m, sight.map.z_m], axis=1)
        self._map.point_size = sight.map.cell_m / 2.0
        fill_cloud(self._map, points, map_colours(sight.map, sight.colour, light=sight.light))
