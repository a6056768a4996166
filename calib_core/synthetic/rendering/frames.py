"""Frames: the still backdrop with reflectors and people in front of it, plus camera noise.

A person is capsules traced analytically, one ray per pixel, with smooth outlines and a soft shadow; robot cars, cars and carts
are painted blocks on wheels, with a box of cardboard behind a reflector.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.synthetic.rendering.reflector import (
    Facet,
    lit_facet,
    reflector_facets,
    shadow_limbs,
    stand_limbs,
)
from calib_core.synthetic.rendering.still import LENS_BLUR_PX, Still, trace_still
from calib_core.synthetic.rendering.surfaces import display, lit
from calib_core.synthetic.rig import Rig, Window
from calib_core.synthetic.scene.person import Capsule, PersonState, Surface, capsules
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M, Scene
from calib_core.synthetic.scene.story import Moment
from calib_core.synthetic.scene.surroundings import cart_position
from calib_core.synthetic.scene.traffic import Colour, VehicleState, vehicle_parts

if TYPE_CHECKING:  # boards need what calibrates a lens, which is slow to import
    from calib_core.synthetic.boards import MovingBoard

_FINE = 8
_COARSE = 3
_LARGE_PX = 150.0
"""Larger vehicles are drawn on a coarser window; it would need hundreds of megabytes."""
_SHIFT = 6
_SOFT_SHADOW, _INDOORS = 0.62, 0.4
_GROUND_STAND_M = 0.35
"""Apexes below sit on their block, others on a tripod."""


@dataclass(frozen=True, slots=True, eq=False)
class _Thing:
    """A moving object in the image: the farthest is drawn first."""

    distance_m: float
    draw: Callable[[np.ndarray], None]
    shadow: tuple[Capsule, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class FrameRenderer:
    """Renders moments of one scene through one camera.

    Attributes:
        scene: with its light.
        rig: the sensors.
        still: the backdrop.
        companion: whether a cart stands behind each reflector.
        edge_m: length of the edges that meet at a reflector's apex.
    """

    scene: Scene
    rig: Rig
    still: Still
    companion: bool = False
    edge_m: float = USUAL_EDGE_M

    @classmethod
    def of(cls, scene: Scene, rig: Rig, *, companion: bool = False, edge_m: float = USUAL_EDGE_M) -> "FrameRenderer":
        """Trace the backdrop, which takes some seconds, and return a renderer."""
        return cls(scene, rig, trace_still(scene, rig), companion, edge_m)

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
            self._shade(levels, thing.shadow)
        for thing in sorted(things, key=lambda thing: -thing.distance_m):
            thing.draw(levels)
        if board is not None:
            from calib_core.synthetic.boards import draw_board

            draw_board(levels, board, blur_px=LENS_BLUR_PX)
        if noise_grey > 0.0 and rng is not None:
            levels += noise_grey * rng.standard_normal(levels.shape, dtype=np.float32)
        return cv2.cvtColor(np.clip(levels + 0.5, 0.0, 255.0).astype(np.uint8), cv2.COLOR_RGB2BGR)

    def reflector(
        self, apex_m: Vector3, facing_rad: float, *, at_rest: bool, rests_at_m: float
    ) -> tuple[tuple[Capsule, ...], list[Facet]]:
        """Return the stand of a reflector and its facets, which are drawn over it.

        Args:
            apex_m: (3,) in the world.
            facing_rad: heading it faces.
            at_rest: whether it stands.
            rests_at_m: height of the apex while it does.
        """
        grounded = rests_at_m < _GROUND_STAND_M
        stand = () if grounded else stand_limbs(apex_m, at_rest=at_rest)
        facets = reflector_facets(
            apex_m, facing_rad, scene=self.scene, eye_m=self.still.eye_m, grounded=grounded, edge_m=self.edge_m
        )
        return stand, facets

    def _things(self, moment: Moment, person: bool) -> list[_Thing]:
        """List what moves, people first: so do their shadows fall."""
        people = (moment.person, *moment.passers_by) if person else moment.passers_by
        things = [self._person(state) for state in people]
        states = [actor.state for actor in moment.traffic]
        things += [self._vehicle(state) if isinstance(state, VehicleState) else self._person(state) for state in states]
        shown = [(moment.reflector_m, moment.facing_rad, moment.resting is not None, moment.next_height_m)]
        if not person and moment.resting is None:
            shown = []
        shown += [(one.position_m, one.facing_rad, True, float(one.position_m[2])) for one in moment.standing]
        things += [self._reflector(*one) for one in shown]
        return [*things, *(self._cart(apex_m) for apex_m, *_ in shown)] if self.companion else things

    def _person(self, state: PersonState) -> _Thing:
        limbs = capsules(state)
        distance = float(np.linalg.norm(np.array([state.x_m, state.y_m, 1.0]) - self.still.eye_m))
        return _Thing(distance, lambda levels: self._draw_limbs(levels, limbs), limbs)

    def _vehicle(self, state: VehicleState) -> _Thing:
        facets = self._vehicle_facets(state)
        distance = float(np.linalg.norm([state.x_m, state.y_m, 0.5 * state.size_m[2]] - self.still.eye_m))
        reach = 0.5 * float(np.hypot(*state.size_m[:2]))  # the ground below its near end is no nearer than that
        outlines = [self.rig.camera.project(self.rig.camera_from_world @ facet.corners_m) for facet in facets]
        whole = [bool(np.isfinite(outline).all()) for outline in outlines]
        shown = [facet for facet, good in zip(facets, whole, strict=True) if good]
        spans = [np.ptp(outline, axis=0).max() for outline, good in zip(outlines, whole, strict=True) if good]
        fine = _FINE if max(spans, default=0.0) < _LARGE_PX else _COARSE
        return _Thing(
            distance, lambda levels: self._draw_facets(levels, shown, distance - reach, fine), vehicle_shadow(state)
        )

    def _vehicle_facets(self, state: VehicleState) -> list[Facet]:
        """Build the visible faces of a vehicle, in the order in which they cover one another."""
        facets: list[Facet] = []
        for part in vehicle_parts(state):
            paint = _PAINTS[(state.number - 1) % len(_PAINTS)] if part.colour == "paint" else _COLOURS[part.colour]
            facets += lit_facet(
                part.corners_m,
                part.normal,
                np.array(paint, dtype=np.float32),
                self.scene,
                self.still.eye_m,
                steps=_VEHICLE_STEPS,
            )
        return facets

    def _reflector(self, apex_m: Vector3, facing_rad: float, at_rest: bool, rests_at_m: float) -> _Thing:
        stand, facets = self.reflector(apex_m, facing_rad, at_rest=at_rest, rests_at_m=rests_at_m)
        distance = float(np.linalg.norm(apex_m - self.still.eye_m))

        def draw(levels: np.ndarray) -> None:
            self._draw_limbs(levels, stand)
            self._draw_facets(levels, facets, distance)

        return _Thing(distance, draw, (*shadow_limbs(apex_m, facing_rad, self.edge_m), *stand))

    def _cart(self, apex_m: Vector3) -> _Thing:
        place_m = cart_position(apex_m)
        facets = cart_facets(place_m, self.scene, self.still.eye_m)
        distance = float(np.linalg.norm(place_m - self.still.eye_m))
        return _Thing(distance, lambda levels: self._draw_facets(levels, facets, distance))

    def _window(self, points_m: Points3, margin_px: float = 2.0) -> Window | None:
        """Return the part of the image in which points of the world (n, 3) are."""
        return Window.around(self.rig.camera.project(self.rig.camera_from_world @ points_m), self.rig.camera, margin_px)

    def _draw_limbs(self, levels: np.ndarray, limbs: tuple[Capsule, ...]) -> None:
        """Draw limbs into the image, farthest first, hidden by nearer parts of the backdrop."""
        still, pixel_rad = self.still, 1.0 / float(self.rig.camera.matrix_px[0, 0])
        for limb in sorted(
            limbs, key=lambda limb: -float(np.linalg.norm(limb.start_m + limb.end_m - 2.0 * still.eye_m))
        ):
            window = self._window(_outline(limb))
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
            colour = display(_limb_colour(limb, normal, share, self.scene))
            patch = levels[window.rows, window.columns]
            patch += (colour - patch) * cover[..., None]

    def _shade(self, levels: np.ndarray, limbs: tuple[Capsule, ...]) -> None:
        """Darken the ground, in place, where limbs cast a shadow; the farther they are, the softer it is."""
        if not limbs:
            return
        still, towards = self.still, self.scene.towards_sun
        ends = np.concatenate([_outline(limb, 0.05) for limb in limbs])
        window = self._window(_feet(ends, towards), 6.0)
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
        strength = _SOFT_SHADOW if self.scene.ceiling_m == 0.0 else _INDOORS
        factor = 1.0 - strength * dark.reshape(ground.shape)
        levels[window.rows, window.columns] *= (factor ** np.float32(1.0 / 2.2))[..., None]

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
_PENUMBRA = 0.035
"""How fast a shadow's edge softens with the distance to the object that casts it."""


def _outline(limb: Capsule, inflate_m: float = 0.0) -> np.ndarray:
    """Return points (16, 3) around a limb; their pixels bound it."""
    ends = ((limb.start_m, limb.start_radius_m), (limb.end_m, limb.end_radius_m))
    return np.concatenate([end_m + (radius_m + inflate_m) * _CORNERS for end_m, radius_m in ends])


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


def _limb_colour(limb: Capsule, normal: np.ndarray, share: np.ndarray, scene: Scene) -> np.ndarray:
    flat = normal.reshape(-1, 3)
    facing = flat @ scene.towards_sun.astype(np.float32)
    sun = np.clip(0.12 + 0.88 * facing, 0.0, None)  # cloth scatters a little past the edge
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


_COLOURS: dict[Colour, tuple[float, float, float]] = {
    "glass": (0.030, 0.040, 0.050),
    "dark": (0.030, 0.030, 0.032),
    "orange": (0.85, 0.25, 0.03),
    "lamp": (0.85, 0.85, 0.80),
    "tail": (0.55, 0.02, 0.02),
}
_PAINTS = ((0.45, 0.03, 0.03), (0.60, 0.61, 0.62), (0.04, 0.10, 0.32), (0.75, 0.74, 0.70), (0.05, 0.22, 0.10))
"""Of the first car, the second and so on."""
_VEHICLE_STEPS = 4


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


_METAL = np.array([0.55, 0.57, 0.60], dtype=np.float32)
_CARDBOARD = np.array([0.50, 0.36, 0.20], dtype=np.float32)
_PARTS = (((0.35, 0.25, 0.12, 0.22), _METAL), ((0.30, 0.22, 0.22, 0.85), _CARDBOARD))
"""Half length, half width, bottom and top of each part [m], and its colour."""


def cart_facets(echo_m: Vector3, scene: Scene, eye_m: Vector3) -> list[Facet]:
    """Build the visible faces of a cart around its echo (3,) in the world, lower part first."""
    heading_rad = float(np.arctan2(echo_m[1], echo_m[0]))
    forward = np.array([np.cos(heading_rad), np.sin(heading_rad), 0.0])
    left = np.array([-forward[1], forward[0], 0.0])
    centre = np.array([echo_m[0], echo_m[1], 0.0])
    facets: list[Facet] = []
    for (half_length_m, half_width_m, bottom_m, top_m), colour in _PARTS:
        sides = [half_length_m * forward, half_width_m * left, -half_length_m * forward, -half_width_m * left]
        for one, other in zip(sides, [*sides[1:], sides[0]], strict=True):
            ring = np.array([centre + one - other, centre + one + other, centre + one + other, centre + one - other])
            ring[:, 2] = [bottom_m, bottom_m, top_m, top_m]
            facets += lit_facet(ring, one / np.linalg.norm(one), colour, scene, eye_m)
        top = np.array([centre + sides[a] + sides[b] for a, b in ((0, 1), (0, 3), (2, 3), (2, 1))])
        top[:, 2] = top_m
        facets += lit_facet(top, np.array([0.0, 0.0, 1.0]), colour, scene, eye_m)
    return facets
