"""Frames: the still backdrop with reflectors and people in front of it, plus camera noise."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.options import ReflectorDesign, Surroundings
from calib_core.synthetic.rendering.light import display, sun_direction
from calib_core.synthetic.rendering.people import Window, draw_limbs, shade_ground
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
from calib_core.synthetic.rendering.vehicles import cart_facets, vehicle_facets, vehicle_shadow
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.person import Capsule, PersonState, capsules
from calib_core.synthetic.scene.scenes import USUAL_EDGE_M, Scene
from calib_core.synthetic.scene.story import Moment
from calib_core.synthetic.scene.surroundings import cart_position
from calib_core.synthetic.scene.vehicles import VehicleState

if TYPE_CHECKING:  # boards need what calibrates a lens, which is slow to import
    from calib_core.synthetic.boards import MovingBoard

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
