"""Frames: the still backdrop with reflectors and people in front of it, plus camera noise.

A person is capsules traced analytically, one ray per pixel, with smooth outlines and a soft shadow; robot cars, cars and carts
are painted blocks on wheels, with a box of cardboard behind a reflector.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.options import ReflectorDesign, Surroundings
from calib_core.synthetic.rendering.reflector import (
    Facet,
    on_block,
    pole_limbs,
    reflector_facets,
    shadow_limbs,
    square_facets,
    stand_limbs,
)
from calib_core.synthetic.rendering.still import Still, trace_still
from calib_core.synthetic.rendering.surfaces import display, sun_direction
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.person import Capsule, PersonState, capsules
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M, Scene
from calib_core.synthetic.scene.story import Moment
from calib_core.synthetic.scene.surroundings import cart_position
from calib_core.synthetic.scene.traffic import VehicleState

if TYPE_CHECKING:  # boards need what calibrates a lens, which is slow to import
    from calib_core.synthetic.boards import MovingBoard
from calib_core.camera import Camera
from calib_core.geometry import RigidTransform
from calib_core.synthetic.rendering.surfaces import lit
from calib_core.synthetic.scene.person import Surface
from calib_core.synthetic.scene.traffic import Colour, Part, vehicle_parts

_FINE = 8
_COARSE = 3
_LARGE_PX = 150.0
"""Larger vehicles are drawn on a coarser window; it would need hundreds of megabytes."""
_SHIFT = 6
_SOFT_SHADOW = 0.62
_NOTHING_ELSE = Surroundings()


@dataclass(frozen=True, slots=True, eq=False)
class _Thing:
    """A moving object in the picture: the farthest is drawn first."""

    distance_m: float
    draw: Callable[[np.ndarray], None]
    shadows: tuple[tuple[Capsule, ...], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class FrameRenderer:
    """Renders moments of one scene through one camera."""

    scene: Scene
    rig: Rig
    still: Still
    towards: Vector3
    surroundings: Surroundings = _NOTHING_ELSE
    edge_m: float = USUAL_EDGE_M
    design: ReflectorDesign = "triangular"

    @classmethod
    def of(
        cls,
        scene: Scene,
        rig: Rig,
        surroundings: Surroundings = _NOTHING_ELSE,
        edge_m: float = USUAL_EDGE_M,
        design: ReflectorDesign = "triangular",
    ) -> "FrameRenderer":
        """Trace the backdrop, which takes some seconds, and return a renderer."""
        return cls(scene, rig, trace_still(scene, rig), sun_direction(scene), surroundings, edge_m, design)

    def render(
        self,
        moment: Moment,
        *,
        person: bool = True,
        board: "MovingBoard | None" = None,
        noise_grey: float = 0.0,
        rng: np.random.Generator | None = None,
    ) -> np.ndarray:
        """Render one frame: (h, w, 3) uint8, blue first.

        Args:
            moment: where person and reflector are.
            person: whether to draw the person.
            board: that is waved before everything else.
            noise_grey: standard deviation of the sensor's noise [grey levels].
            rng: random generator of that noise.
        """
        import cv2

        levels = self.still.levels.copy()
        things = self._things(moment, person)
        for thing in things:
            for limbs in thing.shadows:
                self._shade(levels, limbs)
        for thing in sorted(things, key=lambda thing: -thing.distance_m):
            thing.draw(levels)
        if board is not None:
            from calib_core.synthetic.boards import draw_board

            draw_board(levels, board, blur_px=board.film.blur_px)
        if noise_grey > 0.0 and rng is not None:
            levels += noise_grey * rng.standard_normal(levels.shape, dtype=np.float32)
        return cv2.cvtColor(np.clip(levels + 0.5, 0.0, 255.0).astype(np.uint8), cv2.COLOR_RGB2BGR)

    def _things(self, moment: Moment, person: bool) -> list[_Thing]:
        """List what moves, people first: so do their shadows fall."""
        shown = person or moment.resting is not None
        people = [
            self._person(state) for state in ((moment.person, *moment.passers_by) if person else moment.passers_by)
        ]
        states = [actor.state for actor in moment.traffic]
        people += [self._vehicle(state) if isinstance(state, VehicleState) else self._person(state) for state in states]
        reflectors = [self._reflector(moment)] if shown else []
        for resting in moment.standing:
            height_m = float(resting.position_m[2])
            other = Moment(moment.person, resting.position_m, resting.facing_rad, resting, height_m)
            reflectors.append(self._reflector(other))
        carts: list[_Thing] = []
        if self.surroundings.companion:
            apexes = [moment.reflector_m] if shown else []
            carts = [self._cart(apex) for apex in (*apexes, *(resting.position_m for resting in moment.standing))]
        return [*people, *reflectors, *carts]

    def _person(self, state: PersonState) -> _Thing:
        limbs = capsules(state)
        distance = float(np.linalg.norm(np.array([state.x_m, state.y_m, 1.0]) - self.still.eye_m))
        return _Thing(distance, lambda levels: self._draw_limbs(levels, limbs), (limbs,))

    def _vehicle(self, state: VehicleState) -> _Thing:
        facets = vehicle_facets(state, scene=self.scene, towards=self.towards, eye_m=self.still.eye_m)
        distance = float(np.linalg.norm([state.x_m, state.y_m, 0.5 * state.size_m[2]] - self.still.eye_m))
        reach = 0.5 * float(np.hypot(*state.size_m[:2]))  # the ground below its near end is no nearer than that
        outlines = [self.rig.camera.project(self.rig.camera_from_world @ facet.corners_m) for facet in facets]
        shown = [facet for facet, outline in zip(facets, outlines, strict=True) if np.isfinite(outline).all()]
        spans = [np.ptp(outline, axis=0).max() for outline in outlines if np.isfinite(outline).all()]
        fine = _FINE if max(spans, default=0.0) < _LARGE_PX else _COARSE
        return _Thing(
            distance, lambda levels: self._draw_facets(levels, shown, distance - reach, fine), (vehicle_shadow(state),)
        )

    def _reflector(self, moment: Moment) -> _Thing:
        if self.design == "square":
            return self._square_reflector(moment)
        raised = not on_block(moment.next_height_m)
        stand = stand_limbs(moment.reflector_m, at_rest=moment.resting is not None) if raised else ()

        def draw(levels: np.ndarray) -> None:
            self._draw_limbs(levels, stand)
            self._draw_reflector(levels, moment)

        distance = float(np.linalg.norm(moment.reflector_m - self.still.eye_m))
        return _Thing(distance, draw, ((*shadow_limbs(moment.reflector_m, moment.facing_rad, self.edge_m), *stand),))

    def _square_reflector(self, moment: Moment) -> _Thing:
        apex_m, facing_rad = moment.reflector_m, moment.facing_rad
        pole = pole_limbs(apex_m, facing_rad, self.edge_m, at_rest=moment.resting is not None)
        facets = square_facets(apex_m, facing_rad, eye_m=self.still.eye_m, edge_m=self.edge_m)
        distance = float(np.linalg.norm(apex_m - self.still.eye_m))

        def draw(levels: np.ndarray) -> None:
            self._draw_limbs(levels, pole)
            self._draw_facets(levels, facets, distance)

        return _Thing(distance, draw, ((*shadow_limbs(apex_m, facing_rad, self.edge_m), *pole),))

    def _cart(self, apex_m: Vector3) -> _Thing:
        place = cart_position(apex_m, self.surroundings)
        facets = cart_facets(place, scene=self.scene, towards=self.towards, eye_m=self.still.eye_m)
        distance = float(np.linalg.norm(place - self.still.eye_m))
        return _Thing(distance, lambda levels: self._draw_facets(levels, facets, distance))

    def _draw_limbs(self, levels: np.ndarray, limbs: tuple[Capsule, ...]) -> None:
        draw_limbs(
            levels,
            limbs,
            scene=self.scene,
            still=self.still,
            camera=self.rig.camera,
            camera_from_world=self.rig.camera_from_world,
            towards=self.towards,
        )

    def _shade(self, levels: np.ndarray, limbs: tuple[Capsule, ...]) -> None:
        shade_ground(
            levels,
            limbs,
            still=self.still,
            camera=self.rig.camera,
            camera_from_world=self.rig.camera_from_world,
            towards=self.towards,
            strength=_SOFT_SHADOW if self.scene.ceiling_m == 0.0 else 0.4,
        )

    def _draw_reflector(self, levels: np.ndarray, moment: Moment) -> None:
        facets = reflector_facets(
            moment.reflector_m,
            moment.facing_rad,
            scene=self.scene,
            towards=self.towards,
            eye_m=self.still.eye_m,
            ground_stand=on_block(moment.next_height_m),
            edge_m=self.edge_m,
        )
        self._draw_facets(levels, facets, float(np.linalg.norm(moment.reflector_m - self.still.eye_m)))

    def _draw_facets(self, levels: np.ndarray, facets: list[Facet], distance_m: float, fine: int = _FINE) -> None:
        """Fill polygons on a finer window and downsample, which keeps edges smooth and unshifted."""
        import cv2

        camera = self.rig.camera
        outlines = [camera.project(self.rig.camera_from_world @ facet.corners_m) for facet in facets]
        window = Window.around(np.concatenate(outlines), camera) if outlines else None
        if window is None:
            return
        height, width = window.rows.stop - window.rows.start, window.columns.stop - window.columns.start
        colour = np.zeros((fine * height, fine * width, 3), dtype=np.float32)
        cover = np.zeros((fine * height, fine * width), dtype=np.uint8)
        origin = np.array([window.columns.start, window.rows.start])
        for facet, outline in zip(facets, outlines, strict=True):
            inside = (outline - origin + 0.5) * fine - 0.5
            points = np.round(inside * (1 << _SHIFT)).astype(np.int32)
            level = display(facet.colour[None].astype(np.float32))[0]
            cv2.fillPoly(colour, [points], [float(c) for c in level], cv2.LINE_8, _SHIFT)
            cv2.fillPoly(cover, [points], [255], cv2.LINE_8, _SHIFT)
        fine_cover = (cover > 0).astype(np.float32)
        share = cv2.resize(fine_cover, (width, height), interpolation=cv2.INTER_AREA)
        mean = cv2.resize(colour * fine_cover[..., None], (width, height), interpolation=cv2.INTER_AREA)
        share = share * (distance_m < self.still.depth_m[window.rows, window.columns] + 0.1)
        patch = levels[window.rows, window.columns]
        patch *= (1.0 - share)[..., None]
        patch += mean.reshape(height, width, 3) * (share > 0)[..., None]


_ALBEDO: dict[Surface, tuple[float, float, float]] = {
    "skin": (0.52, 0.33, 0.24),
    "helmet": (0.93, 0.66, 0.04),
    "jacket": (0.055, 0.075, 0.14),
    "vest": (0.95, 0.30, 0.035),
    "yoke": (0.95, 0.30, 0.035),
    "trousers": (0.050, 0.058, 0.085),
    "shoe": (0.035, 0.030, 0.028),
    "stripe": (0.85, 0.85, 0.80),
}
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_FAR_PX = 1e6
_PENUMBRA = 0.035
"""How fast a shadow's edge softens with the distance to the object that casts it."""


class Window:
    """A rectangle of the picture, given by its row and column slices."""

    __slots__ = ("columns", "rows")

    def __init__(self, rows: slice, columns: slice) -> None:
        self.rows, self.columns = rows, columns

    @classmethod
    def around(cls, pixels_px: np.ndarray, camera: Camera, margin_px: float = 2.0) -> "Window | None":
        """Return the window around pixels (n, 2); None if it is outside the picture or they are not in front."""
        if not np.all(np.isfinite(pixels_px)):
            return None
        bounded = np.clip(pixels_px, -_FAR_PX, _FAR_PX)  # next to the plane of the lens, pixels are beyond any integer
        low = np.floor(bounded.min(axis=0) - margin_px).astype(int)
        high = np.ceil(bounded.max(axis=0) + margin_px + 1).astype(int)
        low, high = np.maximum(low, 0), np.minimum(high, [camera.width_px, camera.height_px])
        if np.any(high <= low):
            return None
        return cls(slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0])))


def _outline(limb: Capsule, inflate_m: float = 0.0) -> np.ndarray:
    """Return points (16, 3) around a limb; their pixels bound it."""
    return np.concatenate(
        [
            limb.start_m + (limb.start_radius_m + inflate_m) * _CORNERS,
            limb.end_m + (limb.end_radius_m + inflate_m) * _CORNERS,
        ]
    )


def _nearest(
    origins: np.ndarray, rays: np.ndarray, limb: Capsule
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Find the closest points of rays and a limb's axis.

    Returns:
        the vector from axis to ray (..., 3), its length, the distance along the ray, and the share along the axis (0 to 1).
    """
    axis = (limb.end_m - limb.start_m).astype(np.float32)
    to_start = limb.start_m.astype(np.float32) - origins
    ray_axis = rays @ axis
    ray_start = rays[..., 0] * to_start[..., 0] + rays[..., 1] * to_start[..., 1] + rays[..., 2] * to_start[..., 2]
    length2 = float(axis @ axis)
    flat = np.maximum(length2 - ray_axis**2, 1e-9)
    share = np.clip((ray_axis * ray_start - to_start @ axis) / flat, 0.0, 1.0)
    along = np.maximum(ray_start + share * ray_axis, 0.0)
    gap = along[..., None] * rays - to_start - share[..., None] * axis
    distance = np.sqrt(gap[..., 0] ** 2 + gap[..., 1] ** 2 + gap[..., 2] ** 2)
    return gap, distance, along, share


def draw_limbs(
    levels: np.ndarray,
    limbs: tuple[Capsule, ...],
    *,
    scene: Scene,
    still: Still,
    camera: Camera,
    camera_from_world: RigidTransform,
    towards: Vector3,
) -> None:
    """Draw limbs into the picture, farthest first, hidden by nearer parts of the backdrop.

    Args:
        levels: (h, w, 3) grey levels, changed in place.
        limbs: in the world.
        scene: for its light.
        still: the backdrop.
        camera: the intrinsics.
        camera_from_world: the camera's pose.
        towards: (3,) direction of the sun.
    """
    pixel_rad = 1.0 / float(camera.matrix_px[0, 0])
    for limb in sorted(limbs, key=lambda one: -float(np.linalg.norm(one.start_m + one.end_m - 2.0 * still.eye_m))):
        window = Window.around(camera.project(camera_from_world @ _outline(limb)), camera)
        if window is None:
            continue
        rays = still.rays[window.rows, window.columns]
        gap, distance, along, share = _nearest(still.eye_m.astype(np.float32), rays, limb)
        radius = limb.start_radius_m + share * (limb.end_radius_m - limb.start_radius_m)
        cover = np.clip((radius - distance) / (along * pixel_rad) + 0.5, 0.0, 1.0)
        cover *= along < still.depth_m[window.rows, window.columns] + 0.05
        if not cover.any():
            continue
        bulge = np.sqrt(np.maximum(radius**2 - distance**2, 0.0))
        normal = (gap - bulge[..., None] * rays) / np.maximum(radius, 1e-4)[..., None]
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-6)
        colour = display(_limb_colour(limb, normal, share, scene, towards))
        patch = levels[window.rows, window.columns]
        patch += (colour - patch) * cover[..., None]


def _limb_colour(limb: Capsule, normal: np.ndarray, share: np.ndarray, scene: Scene, towards: Vector3) -> np.ndarray:
    flat = normal.reshape(-1, 3)
    sun = np.clip(0.12 + 0.88 * (flat @ towards.astype(np.float32)), 0.0, None)  # cloth scatters a little past the edge
    light = lit(scene, flat, sun) * (0.80 + 0.20 * flat[:, 2:3])
    albedo = np.broadcast_to(np.array(_ALBEDO[limb.surface], dtype=np.float32), flat.shape)
    if limb.surface == "vest":
        band = (np.abs(share.ravel() - 0.12) < 0.10) | (np.abs(share.ravel() - 0.72) < 0.10)
        albedo = np.where(band[:, None], np.array(_ALBEDO["stripe"], dtype=np.float32), albedo)
    return (albedo * light).reshape(normal.shape)


def _feet(ends: np.ndarray, towards: Vector3) -> np.ndarray:
    """Project points (n, 3) onto the ground along the light."""
    feet = ends - (np.maximum(ends[:, 2:3], 0.0) / towards[2]) * towards
    feet[:, 2] = 0.0
    return feet


def _near_shadow(points: np.ndarray, limb: Capsule, towards: Vector3) -> np.ndarray:
    """Return the rows of ground points that a limb's shadow, including its soft edge, can reach."""
    feet = _feet(_outline(limb, 0.22), towards)
    low, high = feet.min(axis=0), feet.max(axis=0)
    x, y = points[:, 0], points[:, 1]
    return np.flatnonzero((x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1]))


def shade_ground(
    levels: np.ndarray,
    limbs: tuple[Capsule, ...],
    *,
    still: Still,
    camera: Camera,
    camera_from_world: RigidTransform,
    towards: Vector3,
    strength: float = 0.62,
) -> None:
    """Darken the ground, in place, where limbs cast a shadow; the farther they are, the softer it is."""
    if not limbs:
        return
    ends = np.concatenate([_outline(limb, 0.05) for limb in limbs])
    window = Window.around(camera.project(camera_from_world @ _feet(ends, towards)), camera, 6.0)
    if window is None:
        return
    ground = still.ground[window.rows, window.columns]
    rows = np.flatnonzero(ground.ravel())
    rays = still.rays[window.rows, window.columns].reshape(-1, 3)[rows]
    depth = still.depth_m[window.rows, window.columns].ravel()[rows]
    points = (still.eye_m + depth[:, None] * rays).astype(np.float32)
    sun = np.broadcast_to(towards.astype(np.float32), points.shape)
    free = np.ones(len(rows), dtype=np.float32)
    for limb in limbs:
        near = _near_shadow(points, limb, towards)
        _, distance, along, share = _nearest(points[near], sun[near], limb)
        radius = limb.start_radius_m + share * (limb.end_radius_m - limb.start_radius_m)
        soft = 0.012 + _PENUMBRA * along
        free[near] = np.minimum(free[near], np.clip((distance - radius) / (2.0 * soft) + 0.5, 0.0, 1.0))
    dark = np.zeros(ground.size, dtype=np.float32)
    dark[rows] = 1.0 - free
    factor = 1.0 - strength * dark.reshape(ground.shape)
    levels[window.rows, window.columns] *= (factor ** np.float32(1.0 / 2.2))[..., None]


_COLOURS: dict[Colour, tuple[float, float, float]] = {
    "paint": (0.0, 0.0, 0.0),
    "glass": (0.030, 0.040, 0.050),
    "dark": (0.030, 0.030, 0.032),
    "orange": (0.85, 0.25, 0.03),
    "lamp": (0.85, 0.85, 0.80),
    "tail": (0.55, 0.02, 0.02),
}
_PAINTS = ((0.45, 0.03, 0.03), (0.60, 0.61, 0.62), (0.04, 0.10, 0.32), (0.75, 0.74, 0.70), (0.05, 0.22, 0.10))
"""Of the first car, the second and so on."""
_STEPS = 4


def vehicle_facets(state: VehicleState, *, scene: Scene, towards: Vector3, eye_m: Vector3) -> list[Facet]:
    """Build the visible faces of a vehicle, in the order in which they cover one another.

    Args:
        state: the vehicle.
        scene: for its light.
        towards: (3,) direction of the sun.
        eye_m: (3,) the camera.
    """
    facets = []
    for part in vehicle_parts(state):
        if float(part.normal @ (eye_m - part.corners_m.mean(axis=0))) <= 0.0:
            continue
        light = lit(scene, part.normal[None], np.array([max(0.0, float(part.normal @ towards))]))[0]
        paint = _PAINTS[(state.number - 1) % len(_PAINTS)] if part.colour == "paint" else _COLOURS[part.colour]
        facets.append(Facet(_subdivided(part), np.array(paint, dtype=np.float32) * light))
    return facets


def _subdivided(part: Part) -> np.ndarray:
    """Insert points between the corners of an outline, so that lens distortion can bend it."""
    shares = np.arange(_STEPS)[:, None] / _STEPS
    following = np.roll(part.corners_m, -1, axis=0)
    return np.concatenate([a + shares * (b - a) for a, b in zip(part.corners_m, following, strict=True)])


def vehicle_shadow(state: VehicleState) -> tuple[Capsule, ...]:
    """Return capsules that cast about a vehicle's shadow."""
    length, width, height = state.size_m
    radius = min(0.5 * height, 0.28 * width)
    reach = 0.5 * length - radius
    limbs = []
    for side in (-1.0, 0.0, 1.0):
        ends = state.world(np.array([[s * reach, side * (0.5 * width - radius), 0.45 * height] for s in (-1.0, 1.0)]))
        limbs.append(Capsule(ends[0], ends[1], radius, radius, "shoe"))
    return tuple(limbs)


_METAL = (0.55, 0.57, 0.60)
_CARDBOARD = (0.50, 0.36, 0.20)
_PARTS = (((0.35, 0.25, 0.12, 0.22), _METAL), ((0.30, 0.22, 0.22, 0.85), _CARDBOARD))
"""Half length, half width, bottom and top of each part [m], and its colour."""


def cart_facets(echo_m: Vector3, *, scene: Scene, towards: Vector3, eye_m: Vector3) -> list[Facet]:
    """Build the visible faces of a cart around its echo, lower part first.

    Args:
        echo_m: (3,) where the radar sees it, in the world.
        scene: for its light.
        towards: (3,) direction of the sun.
        eye_m: (3,) the camera.
    """
    heading_rad = float(np.arctan2(echo_m[1], echo_m[0]))
    forward = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    left = np.array([-forward[1], forward[0], 0.0])
    facets: list[Facet] = []
    for (half_length_m, half_width_m, bottom_m, top_m), colour in _PARTS:
        sides = [half_length_m * forward, half_width_m * left, -half_length_m * forward, -half_width_m * left]
        centre = np.array([echo_m[0], echo_m[1], 0.0])
        for one, other in zip(sides, [*sides[1:], sides[0]], strict=True):
            ring = np.array([centre + one - other, centre + one + other, centre + one + other, centre + one - other])
            ring[:, 2] = [bottom_m, bottom_m, top_m, top_m]
            facets += _face(ring, one / np.linalg.norm(one), colour, scene, towards, eye_m)
        top = np.array([centre + a + b for a, b in ((sides[0], sides[1]), (sides[0], sides[3]))])
        top = np.concatenate([top, [centre + sides[2] + sides[3], centre + sides[2] + sides[1]]])
        top[:, 2] = top_m
        facets += _face(top, np.array([0.0, 0.0, 1.0]), colour, scene, towards, eye_m)
    return facets


def _face(
    corners_m: np.ndarray, normal: Vector3, colour: tuple[float, ...], scene: Scene, towards: Vector3, eye_m: Vector3
) -> list[Facet]:
    """Return one face with its light, if the camera sees its outside."""
    if float(normal @ (eye_m - corners_m.mean(axis=0))) <= 0.0:
        return []
    light = lit(scene, normal[None], np.array([max(0.0, float(normal @ towards))]))[0]
    return [Facet(corners_m, np.array(colour, dtype=np.float32) * light)]
