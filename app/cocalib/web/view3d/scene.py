"""The 3D view of one tab, in viser: radar axes, chosen returns, placements, the camera with its image."""

import threading
from typing import TYPE_CHECKING, Any

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.geometry import quaternion_wxyz_from_matrix
from calib_core.results import Calibration, PairResult
from cocalib.colours import residual_colours
from cocalib.view.model import PlacementState
from cocalib.web.frames import Frame
from cocalib.web.messages.incoming import Viewpoint
from cocalib.web.view3d.extent import UNKNOWN, Extent, fitted_stand, ring_ranges_m
from cocalib.web.view3d.returns import SizedClouds, map_colours, size_classes
from cocalib.web.view3d.shapes import (
    DARK,
    LIGHT,
    add_cloud,
    add_lines,
    ellipsoids,
    fill_cloud,
    fill_lines,
    next_place,
    nominal_camera_from_radar,
    range_rings,
    rays_to,
    vertical_field_of_view_rad,
)
from cocalib.web.view3d.sight import Sight, ground_m, true_positions

if TYPE_CHECKING:
    import viser


STAND_AT, LOOK_AT = (-5.0, 0.0, 3.6), (6.0, 0.0, -0.4)
"""Initial position and target of the 3D view's camera, until the extent of the data is known."""

FIELD_OF_VIEW_RAD = 0.75

_MOST_ELLIPSOIDS = 200
_LARGE_PX = 30.0  # as in static/base/colours.js: a colour means the same after every click
"""More would be a cloud in which none can be told from the others, and 2 kB each for every answer."""
_MARGIN = 1.4
"""An image hides what is so much wider than it: a placement has a ring."""
_AXES_SHARE, _FRUSTUM_SHARE, _RETURN_SHARE = 0.045, 0.04, 0.005
"""Sizes of the radar's axes, the camera's frustum and a usual return, as shares of the viewer's distance from them."""
_DIM, _ORANGE = (112, 124, 136), (255, 180, 84)
_USUAL_ASPECT, _SAME_ASPECT = 1.4, 0.02


class TabScene:
    """The nodes of one tab's 3D view: added once, then changed by assigning properties. To be used by one thread at a time."""

    def __init__(self, client: "viser.ClientHandle") -> None:
        self._client = client
        self._lock = threading.Lock()
        self._image: Frame | None = None
        self._places_m = np.zeros((0, 3))
        self._camera_from_radar = nominal_camera_from_radar()
        self._posed: object = self
        self._paired: object = None
        self._extent: Extent | None = None
        self._viewpoint: Viewpoint = "behind"
        self._stood_at, self._aspect = np.array(STAND_AT), 0.0
        scene = client.scene
        scene.configure_default_lights(
            False
        )  # nothing here needs light, and without it drawing takes less than half as long
        scene.configure_environment_map(None)
        self._axes = scene.add_frame("/radar", axes_length=0.6, axes_radius=0.018, origin_radius=0.03)
        self._shown = scene.add_frame("/shown", show_axes=False)
        self._palette = DARK
        self._grid, self._rings = _ground(scene)
        self._survey = SurveyNodes(scene)
        self._returns = SizedClouds(scene, "/returns")
        self._window = add_cloud(scene, "/window", 0.06)
        self._chosen = add_cloud(scene, "/chosen", 0.24)
        self._rays = add_lines(scene, "/rays", 1.0, (72, 110, 138))
        self._ray = add_lines(scene, "/ray", 2.0, DARK.ray)
        self._gap = add_lines(scene, "/gap", 3.0, _ORANGE)
        self._ellipsoids = add_lines(scene, "/ellipsoids", 1.0, (96, 118, 140))
        self._ellipsoid = add_lines(scene, "/ellipsoid", 1.5, _ORANGE)
        self._next = add_lines(scene, "/next", 2.0, DARK.next)
        self._frustum = scene.add_camera_frustum(
            "/camera",
            fov=0.9,
            aspect=1.6,
            scale=1.1,
            thickness=1.5,
            thickness_units="screen",
            color=_DIM,
            format="jpeg",
        )
        client.camera.on_update(lambda _: self._follow_viewer())

    def show(self, sight: Sight) -> None:
        """Draw a Sight."""
        with self._lock, self._client.atomic():
            self._show_theme(sight)
            self._show_extent(sight)
            self._show_returns(sight)
            self._survey.show(sight)
            self._frustum.visible = sight.has_images
            if sight.has_images:
                self._show_pose(sight)
                self._show_pairs(sight)
                self._show_advice(sight)
                self._image = sight.image or self._image
                self._places_m = sight.placements_m()
                self._show_image()
            self._shown.position = (float(sight.index), float(sight.number), 0.0)  # the page reads which frame this is
        self._client.flush()

    def look_from(self, viewpoint: Viewpoint) -> None:
        """Move the view's own camera: "behind", "above" or "side", so that all of the data is in sight."""
        with self._lock:
            self._look_from(viewpoint)
        self._client.flush()

    def _look_from(self, viewpoint: Viewpoint) -> None:
        """Stand where the data fill the view; what marks a place keeps its size on the screen."""
        camera = self._client.camera
        self._aspect = _aspect_of(camera)
        stand = fitted_stand(self._extent or UNKNOWN, viewpoint, FIELD_OF_VIEW_RAD, self._aspect)
        with self._client.atomic():
            camera.up_direction = tuple(stand.up)
            camera.position, camera.look_at = tuple(stand.position_m), tuple(stand.look_at_m)
            away_m, size_m = float(np.linalg.norm(stand.position_m)), _RETURN_SHARE * stand.distance_m
            self._axes.axes_length, self._axes.axes_radius, self._axes.origin_radius = (
                np.array([1.0, 0.024, 0.04]) * _AXES_SHARE * away_m
            )
            self._frustum.scale = _FRUSTUM_SHARE * away_m
            self._returns.resize(size_m)
            self._window.point_size, self._chosen.point_size = 0.5 * size_m, 1.8 * size_m
        self._viewpoint, self._stood_at = viewpoint, stand.position_m
        self._show_image()

    def _follow_viewer(self) -> None:
        """Fit a view of another shape to the data unless the user has moved it, and keep the image off the placements."""
        with self._lock:
            if abs(_aspect_of(self._client.camera) - self._aspect) > _SAME_ASPECT and self._is_still():
                self._look_from(self._viewpoint)
            self._show_image()
        self._client.flush()

    def _is_still(self) -> bool:
        """Say whether the view is where it was put."""
        return np.allclose(self._client.camera.position, self._stood_at, atol=1e-3)

    def _show_extent(self, sight: Sight) -> None:
        """Fit rings, grid and, unless the user has moved it, the viewpoint to the data once they are known."""
        if sight.colouring.extent == self._extent:
            return
        self._extent = sight.colouring.extent
        ranges_m = ring_ranges_m(sight.colouring.extent.range_m)
        fill_lines(self._rings, range_rings(ranges_m))
        step_m, across_m = ranges_m[0], 2.0 * ranges_m[-1]
        self._grid.width = self._grid.height = across_m
        self._grid.cell_size, self._grid.section_size = step_m / 5.0, step_m
        self._grid.fade_distance = 3.0 * across_m
        if self._is_still():
            self._look_from(self._viewpoint)

    def _show_theme(self, sight: Sight) -> None:
        """Recolour the single-colour nodes to suit the background."""
        palette = LIGHT if sight.colouring.light else DARK
        if palette is self._palette:
            return
        self._palette, self._posed = palette, self
        for node, colour in ((self._ray, palette.ray), (self._next, palette.next), (self._rings, palette.rings)):
            node.colors = np.array(colour, dtype=np.uint8)
        self._grid.cell_color = self._grid.section_color = palette.cells

    def _show_returns(self, sight: Sight) -> None:
        returns, window = sight.returns, sight.window
        colours = sight.colouring.of(returns, sight.trail_s)
        classes = size_classes(returns.snr_db, sight.colouring.snr_db)
        self._returns.fill(returns.points_m, colours, classes)
        fill_cloud(
            self._window, window.points_m, np.tile(np.array([self._palette.window], dtype=np.uint8), (len(window), 1))
        )

    def _show_pose(self, sight: Sight) -> None:
        """Move the frustum, and the ground to the lowest chosen return, whenever the answer changes."""
        outcome = sight.session.outcome
        if outcome is self._posed:
            return
        self._posed = outcome
        calibration = sight.calibration
        camera = calibration.camera if calibration else sight.camera
        self._camera_from_radar = calibration.camera_from_radar if calibration else nominal_camera_from_radar()
        radar_from_camera = self._camera_from_radar.inverse()
        self._frustum.wxyz = quaternion_wxyz_from_matrix(radar_from_camera.rotation)
        self._frustum.position = radar_from_camera.translation_m
        self._frustum.color = self._palette.solved if isinstance(outcome, Calibration) else _DIM
        if camera is not None:
            self._frustum.fov = vertical_field_of_view_rad(camera)
            self._frustum.aspect = camera.width_px / camera.height_px
        self._grid.position = (0.0, 0.0, ground_m(sight))

    def _show_pairs(self, sight: Sight) -> None:
        calibration = sight.session.outcome
        drawn = (calibration, sight.selected)
        if drawn == self._paired:  # a Calibration equals only itself; moving through the frames changes none of these
            return
        self._paired = drawn
        if not isinstance(calibration, Calibration):
            for node in (self._chosen, self._rays, self._ray, self._gap, self._ellipsoids, self._ellipsoid):
                node.visible = False
            return
        points = true_positions(calibration, calibration.pairs)
        residuals = np.array([pair.distance_px for pair in calibration.pairs])
        fill_cloud(self._chosen, points, residual_colours(residuals, _LARGE_PX))
        chosen = tuple(pair for pair in calibration.pairs if pair.id == sight.selected)
        others = tuple(pair for pair in calibration.pairs if pair.inlier and pair.id != sight.selected)
        fill_lines(self._rays, rays_to(calibration, others))
        fill_lines(self._ellipsoids, _shells(calibration, others[:_MOST_ELLIPSOIDS]))
        fill_lines(self._ellipsoid, _shells(calibration, chosen))
        self._show_selected(calibration, chosen)

    def _show_selected(self, calibration: Calibration, chosen: tuple[PairResult, ...]) -> None:
        rays = rays_to(calibration, chosen)
        fill_lines(self._ray, rays)
        points = true_positions(calibration, chosen)
        fill_lines(self._gap, np.stack([rays[0, 1], points[0]])[None] if len(rays) else rays)

    def _show_advice(self, sight: Sight) -> None:
        """Draw a ring around the best next placement."""
        advice = sight.view.advice
        if advice is None or advice.best.may_stop or sight.view.verdict.done:
            self._next.visible = False
            return
        place = advice.best.position_radar_m
        fill_lines(self._next, next_place(place[None], radius_m=max(0.3, 0.04 * sight.colouring.extent.range_m)))

    def _show_image(self) -> None:
        """Show the image in the frustum, or its outline alone where it would hide a placement from the viewer."""
        high = 2.0 * np.tan(self._frustum.fov / 2.0)  # away by 1; viser's own is not as drawn
        away_m = np.multiply(self._frustum.scale, self._frustum.compute_canonical_frustum_size()[2])
        size = away_m * np.array([high * self._frustum.aspect, high, 1.0])
        viewer = self._camera_from_radar @ np.array(self._client.camera.position)
        data = (
            None
            if self._image is None or _is_hidden(self._camera_from_radar @ self._places_m, viewer, size)
            else self._image.data
        )
        if data is not self._frustum._image_data:
            self._frustum._format = "jpeg"
            self._frustum._image_data = data  # compressed bytes as they are; the public property encodes again


def _ground(scene: "viser.SceneApi") -> tuple[Any, Any]:
    """Add the grid with rings of equal range; return the node that moves both, and the rings."""
    grid = scene.add_grid(
        "/ground", width=60.0, height=60.0, cell_size=1.0, section_size=5.0, cell_color=DARK.cells,
        section_color=(52, 62, 73), cell_thickness=0.6, section_thickness=0.8, shadow_opacity=0.0, fade_distance=40.0,
    )  # fmt: skip
    return grid, add_lines(scene, "/ground/rings", 1.2, DARK.rings)


def _aspect_of(camera: Any) -> float:
    """Return width divided by height of the view; a usual one before it has been drawn, or while it is hidden."""
    return camera.image_width / camera.image_height if camera.image_width and camera.image_height else _USUAL_ASPECT


def _is_hidden(points_m: Points3, viewer_m: Vector3, size_m: Vector3) -> bool:
    """Say whether the image of a frustum is between a viewer and any point, all in the camera's frame.

    Args:
        points_m: (n, 3).
        viewer_m: (3,).
        size_m: (3,) width and height of the image, and its distance from the camera.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (size_m[2] - viewer_m[2]) / (points_m[:, 2] - viewer_m[2])
        crossing_m = viewer_m + share[:, None] * (points_m - viewer_m)
    inside = (np.abs(crossing_m[:, :2]) < _MARGIN * size_m[:2] / 2.0).all(axis=1)
    return bool(np.any(inside & (share > 0.0) & (share < 1.0)))


def _shells(calibration: Calibration, pairs: tuple[PairResult, ...]) -> np.ndarray:
    return ellipsoids(true_positions(calibration, pairs), calibration.options.noise, calibration.noise_scale)


_RING_SHARE = 0.025
"""Radius of a placement's ring, as a share of the extent."""


class SurveyNodes:
    """The nodes of viser that show what is known of the whole recording; filled again only when that changes."""

    def __init__(self, scene: "viser.SceneApi") -> None:
        self._map = add_cloud(scene, "/map", 0.1)
        self._rings = {
            state: add_lines(scene, f"/placements_{state}", width_px, DARK.next)
            for state, width_px in (("open", 2.0), ("marked", 1.0))
        }
        self._mapped: object = None
        self._placed: object = None

    def show(self, sight: Sight) -> None:
        """Draw the map and the placements of a Sight."""
        self._show_map(sight)
        states, palette = sight.placement_states(), LIGHT if sight.colouring.light else DARK
        placed = (
            tuple(map(id, sight.placements)),
            states,
            sight.colouring.extent,
            sight.colouring.light,
            id(sight.calibration),
        )
        if placed == self._placed:
            return
        self._placed = placed
        places = sight.placements_m()
        colours: dict[PlacementState, tuple[int, int, int]] = {"open": palette.next, "marked": palette.rings}
        for state, rings in self._rings.items():
            chosen = np.array([one == state for one in states], dtype=bool)
            rings.colors = np.array(colours[state], dtype=np.uint8)  # type: ignore[index]
            fill_lines(
                rings, next_place(places[chosen], radius_m=max(0.15, _RING_SHARE * sight.colouring.extent.range_m))
            )

    def _show_map(self, sight: Sight) -> None:
        shown = (sight.map, sight.colouring.colour, sight.colouring.light)
        if shown == self._mapped:
            return
        self._mapped = shown
        if sight.map is None:
            self._map.visible = False
            return
        points = np.stack([sight.map.x_m, sight.map.y_m, sight.map.z_m], axis=1)
        self._map.point_size = sight.map.cell_m / 2.0
        fill_cloud(self._map, points, map_colours(sight.map, sight.colouring.colour, light=sight.colouring.light))
