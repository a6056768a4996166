"""Frames: the still backdrop with reflector and person in front of it, plus camera noise."""

from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.person import Capsule, capsules
from calib_core.synthetic.rendering.light import display, sun_direction
from calib_core.synthetic.rendering.people import Window, draw_limbs, shade_ground
from calib_core.synthetic.rendering.reflector import (
    Facet,
    on_block,
    reflector_facets,
    shadow_limbs,
    stand_limbs,
)
from calib_core.synthetic.rendering.still import Still, trace_still
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scenes import Scene
from calib_core.synthetic.story import Moment

__all__ = ["FrameRenderer"]

_FINE = 8
_SHIFT = 6
_SOFT_SHADOW = 0.62


@dataclass(frozen=True, slots=True, eq=False)
class FrameRenderer:
    """Renders moments of one scene through one camera."""

    scene: Scene
    rig: Rig
    still: Still
    towards: Vector3

    @classmethod
    def of(cls, scene: Scene, rig: Rig) -> "FrameRenderer":
        """Trace the backdrop, which takes some seconds, and return a renderer."""
        return cls(scene, rig, trace_still(scene, rig), sun_direction(scene))

    def render(
        self, moment: Moment, *, person: bool = True, noise_grey: float = 0.0, rng: np.random.Generator | None = None
    ) -> np.ndarray:
        """Render one frame: (h, w, 3) uint8, blue first.

        Args:
            moment: where person and reflector are.
            person: whether to draw the person.
            noise_grey: standard deviation of the sensor's noise [grey levels].
            rng: random generator of that noise.
        """
        levels = self.still.levels.copy()
        limbs = capsules(moment.person) if person else ()
        shown = person or moment.resting is not None
        raised = shown and not on_block(moment.next_height_m)
        stand = stand_limbs(moment.reflector_m, at_rest=moment.resting is not None) if raised else ()
        self._shade(levels, limbs, stand, moment if shown else None)
        distance = float(np.linalg.norm(moment.reflector_m - self.still.eye_m))
        body = np.array([moment.person.x_m, moment.person.y_m, 1.0])
        nearer = distance < float(np.linalg.norm(body - self.still.eye_m))
        if nearer:
            self._draw_limbs(levels, limbs)
        if shown:
            self._draw_limbs(levels, stand)
            self._draw_reflector(levels, moment)
        if not nearer:
            self._draw_limbs(levels, limbs)
        if noise_grey > 0.0 and rng is not None:
            levels += noise_grey * rng.standard_normal(levels.shape, dtype=np.float32)
        return np.ascontiguousarray(np.clip(levels + 0.5, 0.0, 255.0).astype(np.uint8)[..., ::-1])

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

    def _shade(
        self, levels: np.ndarray, limbs: tuple[Capsule, ...], stand: tuple[Capsule, ...], moment: Moment | None
    ) -> None:
        groups = [limbs]
        if moment is not None:
            groups.append((*shadow_limbs(moment.reflector_m, moment.facing_rad), *stand))
        for group in groups:
            shade_ground(
                levels,
                group,
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
        )
        self._draw_facets(levels, facets, float(np.linalg.norm(moment.reflector_m - self.still.eye_m)))

    def _draw_facets(self, levels: np.ndarray, facets: list[Facet], distance_m: float) -> None:
        """Fill polygons on an eight times finer window and downsample, which keeps edges smooth and unshifted."""
        import cv2

        camera = self.rig.camera
        outlines = [camera.project(self.rig.camera_from_world @ facet.corners_m) for facet in facets]
        window = Window.around(np.concatenate(outlines), camera)
        if window is None:
            return
        height, width = window.rows.stop - window.rows.start, window.columns.stop - window.columns.start
        colour = np.zeros((_FINE * height, _FINE * width, 3), dtype=np.float32)
        cover = np.zeros((_FINE * height, _FINE * width), dtype=np.uint8)
        origin = np.array([window.columns.start, window.rows.start])
        for facet, outline in zip(facets, outlines, strict=True):
            fine = (outline - origin + 0.5) * _FINE - 0.5
            points = np.round(fine * (1 << _SHIFT)).astype(np.int32)
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
