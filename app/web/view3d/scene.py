"""The 3D view of one tab, in viser: radar axes, the scan of the frame, chosen returns, and the camera with its live picture."""

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from app.session import Session
from app.view import Reference, View, shown_calibration
from app.web.frames import Frame
from app.web.radar_sight import still_returns
from app.web.view3d.looking import Look, LookNodes
from app.web.view3d.nodes import add_cloud, add_lines, fill_cloud, fill_lines
from app.web.view3d.shapes import (
    DARK,
    LIGHT,
    ellipsoids,
    next_place,
    nominal_camera_from_radar,
    range_numbers,
    range_rings,
    rays_to,
    residual_colours,
    vertical_field_of_view_rad,
)
from calib_core.arrays import Points3
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.measurements import RadarScan
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, PairResult

if TYPE_CHECKING:
    import viser

__all__ = ["FIELD_OF_VIEW_RAD", "LOOK_AT", "STAND_AT", "Sight", "TabScene"]

STAND_AT, LOOK_AT = (-5.0, 0.0, 3.6), (6.0, 0.0, -0.4)
"""Initial position and target of the 3D view's camera: behind and above the radar, looking forward."""

FIELD_OF_VIEW_RAD = 0.75

_VIEWPOINTS = {
    "behind": (STAND_AT, LOOK_AT),
    "above": ((7.0, 0.0, 26.0), (7.01, 0.0, 0.0)),
    "side": ((7.0, -20.0, 4.0), (7.0, 0.0, 0.0)),
}
_MOST_ELLIPSOIDS = 200
_LARGE_PX = 30.0  # as in static/colours.js: a colour means the same after every click
"""More would be a cloud in which none can be told from the others, and 2 kB each for every answer."""
_RINGS_EVERY_M, _RINGS_UP_TO_M = 5.0, 30.0
_DIM, _ORANGE = (112, 124, 136), (255, 180, 84)


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Everything that one 3D view shows at one moment.

    Attributes:
        session: with the latest answer.
        view: of the same session.
        selected: id of the selected click; None without one.
        scan: of the frame; None when there is none.
        window: (n, 3) static returns around the selected click [m].
        picture: a thumbnail of the frame; None when it cannot be read.
        camera: the recording's intrinsics, used until there is a calibration.
        reference: a calibration to show until there is a new one; None if there is none.
        light: drawn on a light background.
        look: what to show instead of a scan, pairs and camera if the recording has no pictures; else None.
    """

    session: Session
    view: View
    selected: str | None
    scan: RadarScan | None
    window: Points3
    picture: Frame | None
    camera: Camera | None
    reference: Reference | None = None
    light: bool = False
    look: Look | None = None


class TabScene:
    """The nodes of one tab's 3D view: added once, then changed by assigning properties. To be used by one thread at a time."""

    def __init__(self, client: "viser.ClientHandle") -> None:
        self._client = client
        self._lock = threading.Lock()
        self._pictured: int | None = None
        self._looking: LookNodes | None = None
        self._posed: object = self
        self._paired: object = None
        self._radar_from_camera = nominal_camera_from_radar().inverse()
        scene = client.scene
        scene.add_frame("/radar", axes_length=0.6, axes_radius=0.018, origin_radius=0.03)
        self._palette = DARK
        self._grid, self._rings = _ground(scene)
        self._scan = add_cloud(scene, "/scan", 0.12)
        self._window = add_cloud(scene, "/window", 0.06)
        self._chosen = add_cloud(scene, "/chosen", 0.24)
        self._rays = add_lines(scene, "/rays", 1.0, (72, 110, 138))
        self._ray = add_lines(scene, "/ray", 2.0, DARK.ray)
        self._gap = add_lines(scene, "/gap", 3.0, _ORANGE)
        self._ellipsoids = add_lines(scene, "/ellipsoids", 1.0, (96, 118, 140))
        self._ellipsoid = add_lines(scene, "/ellipsoid", 1.5, _ORANGE)
        self._next = add_lines(scene, "/next", 2.0, DARK.next)
        self._next_name = scene.add_label("/next_name", "", visible=False, anchor="top-center", font_screen_scale=0.9)
        self._name = scene.add_label("/selected", "", visible=False, anchor="bottom-left", font_screen_scale=0.9)
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

    def show(self, sight: Sight) -> None:
        """Draw a Sight."""
        with self._lock, self._client.atomic():
            self._show_theme(sight)
            if sight.look is not None:
                self._show_look(sight, sight.look)
            else:
                self._show_scan(sight)
                self._show_pose(sight)
                self._show_pairs(sight)
                self._show_advice(sight)
                self._show_picture(sight)
        self._client.flush()

    def _show_look(self, sight: Sight, look: Look) -> None:
        """Draw a recording without pictures: there is no camera to show."""
        if self._looking is None:
            self._looking = LookNodes(self._client.scene)
            self._frustum.visible = False
        self._looking.show(look, sight.session.options.gating, light=sight.light)

    def look_from(self, viewpoint: str) -> None:
        """Move the view's own camera: "behind", "above", "side" or "camera"."""
        camera = self._client.camera
        with self._client.atomic():
            if viewpoint == "camera":
                rotation, position = self._radar_from_camera.rotation, self._radar_from_camera.translation_m
                camera.up_direction = tuple(-rotation[:, 1])
                camera.position = tuple(position - 0.02 * rotation[:, 2])
                camera.look_at = tuple(position + 8.0 * rotation[:, 2])
                return
            stand, target = _VIEWPOINTS[viewpoint]
            camera.up_direction = (1.0, 0.0, 0.0) if viewpoint == "above" else (0.0, 0.0, 1.0)
            camera.position, camera.look_at = stand, target

    def _show_theme(self, sight: Sight) -> None:
        """Recolour the single-colour nodes to suit the background."""
        palette = LIGHT if sight.light else DARK
        if palette is self._palette:
            return
        self._palette, self._posed = palette, self
        for node, colour in ((self._ray, palette.ray), (self._next, palette.next)):
            node.colors = np.array(colour, dtype=np.uint8)
        for rings in self._rings:
            rings.colors = np.array(palette.rings, dtype=np.uint8)
        self._grid.cell_color = self._grid.section_color = palette.cells

    def _show_scan(self, sight: Sight) -> None:
        if sight.scan is None:
            self._scan.visible = False
            return
        calibration = shown_calibration(sight.session, sight.reference)
        errors = calibration.radar_errors if calibration else RadarErrors()
        still = still_returns(sight.scan, sight.session.options.gating)
        colours = np.where(still[:, None], np.array(self._palette.still), np.array(self._palette.moving)).astype(
            np.uint8
        )
        fill_cloud(self._scan, errors.corrected(sight.scan.points_radar_m), colours)
        window = np.tile(np.array([self._palette.window], dtype=np.uint8), (len(sight.window), 1))
        fill_cloud(self._window, errors.corrected(sight.window), window)

    def _show_pose(self, sight: Sight) -> None:
        """Move the frustum, and the ground to the lowest chosen return, whenever the answer changes."""
        outcome = sight.session.outcome
        if outcome is self._posed:
            return
        self._posed = outcome
        calibration = shown_calibration(sight.session, sight.reference)
        camera = calibration.camera if calibration else sight.camera
        camera_from_radar = calibration.camera_from_radar if calibration else nominal_camera_from_radar()
        self._radar_from_camera = camera_from_radar.inverse()
        _place(self._frustum, self._radar_from_camera)
        self._frustum.color = self._palette.solved if isinstance(outcome, Calibration) else _DIM
        if camera is not None:
            self._frustum.fov = vertical_field_of_view_rad(camera)
            self._frustum.aspect = camera.width_px / camera.height_px
        inliers = tuple(pair for pair in calibration.pairs if pair.inlier) if calibration else ()
        heights = _true_positions(calibration, inliers)[:, 2].tolist() if calibration else []
        self._grid.position = (0.0, 0.0, min([0.0, *heights]))

    def _show_pairs(self, sight: Sight) -> None:
        calibration = sight.session.outcome
        drawn = (calibration, sight.selected)
        if drawn == self._paired:  # a Calibration equals only itself; moving through the frames changes none of these
            return
        self._paired = drawn
        if not isinstance(calibration, Calibration):
            for node in (self._chosen, self._rays, self._ray, self._gap, self._ellipsoids, self._ellipsoid, self._name):
                node.visible = False
            return
        points = _true_positions(calibration, calibration.pairs)
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
        points = _true_positions(calibration, chosen)
        fill_lines(self._gap, np.stack([rays[0, 1], points[0]])[None] if len(rays) else rays)
        self._name.visible = bool(chosen)
        if chosen:
            self._name.position = tuple(points[0] + np.array([0.0, 0.0, 0.15]))
            reported_m = float(np.linalg.norm(chosen[0].point_radar_m))
            self._name.text = f"{chosen[0].id}: {reported_m:.2f} m, {_residual(chosen[0])}"

    def _show_advice(self, sight: Sight) -> None:
        """Draw a ring around the best next placement."""
        advice = sight.view.advice
        if advice is None or advice.may_stop:
            self._next.visible = self._next_name.visible = False
            return
        place = np.array(advice.position_radar_m)
        fill_lines(self._next, next_place(place[None]))
        self._next_name.position = tuple(place - np.array([0.0, 0.0, 0.3]))
        self._next_name.text = f"next {advice.range_m:.1f} m"
        self._next_name.visible = True

    def _show_picture(self, sight: Sight) -> None:
        picture = sight.picture
        if picture is None or picture.index == self._pictured:
            return
        self._pictured = picture.index
        self._frustum._format = "jpeg"
        self._frustum._image_data = picture.data  # compressed bytes as they are; the public property encodes again


def _residual(pair: PairResult) -> str:
    return f"{pair.distance_px:.1f} px" if np.isfinite(pair.distance_px) else "behind the camera"


def _ground(scene: "viser.SceneApi") -> tuple[Any, list[Any]]:
    """Add the grid with rings of equal range and their numbers; return the node that moves them all, and the rings."""
    grid = scene.add_grid(
        "/ground", width=60.0, height=60.0, cell_size=1.0, section_size=5.0, cell_color=DARK.cells,
        section_color=(52, 62, 73), cell_thickness=0.6, section_thickness=0.8, shadow_opacity=0.0, fade_distance=40.0,
    )  # fmt: skip
    extent = {"every_m": _RINGS_EVERY_M, "up_to_m": _RINGS_UP_TO_M}
    rings = [
        scene.add_line_segments(f"/ground/{name}", strokes, DARK.rings, thickness=1.2, thickness_units="screen")
        for name, strokes in (("rings", range_rings(**extent)), ("numbers", range_numbers(**extent)))
    ]
    return grid, rings


def _true_positions(calibration: Calibration, pairs: tuple[PairResult, ...]) -> Points3:
    """Return where the radar's positions of some pairs (n, 3) truly are: its estimated errors are taken out."""
    return calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3))


def _shells(calibration: Calibration, pairs: tuple[PairResult, ...]) -> np.ndarray:
    return ellipsoids(_true_positions(calibration, pairs), calibration.options.noise, calibration.noise_scale)


def _place(node: Any, target_from_node: RigidTransform) -> None:
    node.wxyz = quaternion_wxyz_from_matrix(target_from_node.rotation)
    node.position = target_from_node.translation_m
