"""A reflector of another look: three dull squares, one edge down, on a white pole. Its echo is the usual one."""

from functools import cached_property

import numpy as np

from calib_core.arrays import Vector3
from calib_core.synthetic.recording import SimulatedRecording
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.reflector import Facet, subdivided
from calib_core.synthetic.scene.person import Capsule

__all__ = ["with_square_reflectors"]

_STEEL = np.array([0.46, 0.48, 0.50], dtype=np.float32)
_PAINT = np.array([0.10, 0.16, 0.30], dtype=np.float32)
_SHEET_LEVEL = (0.30, 0.95, 0.60)
"""How bright the upper, the left and the right sheet are."""
_LEAN_RAD = np.deg2rad(14.0)
_NESTED = 5
_POLE_M, _FOOT_M = 0.016, 0.06
_CARRIED_M = 0.35


def with_square_reflectors(recording: SimulatedRecording) -> SimulatedRecording:
    """Return a recording whose images show reflectors of squares."""
    return _Recording(recording.stage, recording.placements, recording.clicks)


class _Renderer(FrameRenderer):
    """Draws the three sheets and the pole."""

    def reflector(
        self, apex_m: Vector3, facing_rad: float, *, at_rest: bool, rests_at_m: float
    ) -> tuple[tuple[Capsule, ...], list[Facet]]:
        """Return the pole of a reflector and its sheets."""
        down, left, right = _edges(facing_rad, self.edge_m)
        eye_m = self.still.eye_m
        facets: list[Facet] = []
        for level, (one, two) in zip(_SHEET_LEVEL, ((left, right), (down, left), (right, down)), strict=True):
            square = np.array([np.zeros(3), one, one + two, two])
            outward = np.cross(one, two)
            if float(outward @ (eye_m - apex_m)) * float(outward @ (left + right + down)) <= 0.0:
                facets.append(Facet(subdivided(apex_m + square), _PAINT))
                continue
            for share in np.linspace(1.0, 0.2, _NESTED):
                colour = level * (0.8 + 0.2 * share) * _STEEL
                facets.append(Facet(subdivided(apex_m + share * square), colour.astype(np.float32)))
        return _pole(apex_m + down, at_rest=at_rest), facets


class _Recording(SimulatedRecording):
    @cached_property
    def renderer(self) -> FrameRenderer:
        return _Renderer.of(self.stage.scene, self.stage.rig, edge_m=self.options.reflector_edge_m)


def _edges(facing_rad: float, edge_m: float) -> np.ndarray:
    """Return the edges from the apex (3, 3): down, upper left, upper right, as seen by a viewer in front."""
    c, s, ce, se = np.cos(facing_rad), np.sin(facing_rad), np.cos(_LEAN_RAD), np.sin(_LEAN_RAD)
    axis = np.array([ce * c, ce * s, se])
    up = np.array([-se * c, -se * s, ce])
    right = np.array([-s, c, 0.0])
    turns = np.deg2rad([180.0, 60.0, -60.0])
    around = np.cos(turns)[:, None] * up - np.sin(turns)[:, None] * right
    return np.asarray(edge_m * (axis / np.sqrt(3.0) + np.sqrt(2.0 / 3.0) * around))


def _pole(top_m: Vector3, *, at_rest: bool) -> tuple[Capsule, ...]:
    """Build the pole below the lowest corner, with its foot while it stands."""
    bottom = top_m * [1.0, 1.0, 0.0] if at_rest else top_m - [0.0, 0.0, _CARRIED_M]
    pole = Capsule(top_m, bottom, _POLE_M, _POLE_M, "stripe")
    if not at_rest:
        return (pole,)
    return (pole, Capsule(bottom, bottom + np.array([0.0, 0.0, 0.01]), _FOOT_M, 0.03, "trousers"))
