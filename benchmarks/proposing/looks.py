"""Reflectors that look otherwise: `python -m benchmarks.proposing.looks` counts proposals after one click, by confidence."""

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np

from benchmarks.proposing.clicking import after_one_click
from benchmarks.proposing.drawn import Drawn, true_placement
from benchmarks.proposing.pixels import on_the_reflector
from benchmarks.proposing.small import draw_small
from calib_core.arrays import Vector3
from calib_core.errors import OptionError
from calib_core.proposing import DwellView, Proposal, Proposals, dwell_views
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.reflector import Facet, subdivided
from calib_core.synthetic.scene.person import Capsule

__all__ = ["LOOKS", "Look", "draw_with_look", "every_dwell", "sheet"]

_WHITE, _BLACK, _STEEL = (np.full(3, level, dtype=np.float32) for level in (0.9, 0.02, 0.5))
_BINS = (0.5, 0.7, 0.8, 0.9)
Facets: TypeAlias = Callable[[Vector3, float], list[Facet]]


def sheet(
    apex_m: Vector3, facing_rad: float, colour: np.ndarray, *, half_m: float, low_m: float, high_m: float
) -> Facet:
    """Return an upright rectangle that faces the sensors, from one height above the apex to another."""
    right = half_m * np.array([-np.sin(facing_rad), np.cos(facing_rad), 0.0])
    low, high = np.array([[0.0, 0.0, low_m], [0.0, 0.0, high_m]])
    return Facet(subdivided(apex_m + np.array([low - right, low + right, high + right, high - right])), colour)


def _board(apex_m: Vector3, facing_rad: float) -> list[Facet]:
    """Return a white board of 0.36 m with a dark opening in which the sheets are."""
    return [
        sheet(apex_m, facing_rad, _WHITE, half_m=0.18, low_m=-0.13, high_m=0.23),
        sheet(apex_m, facing_rad, _BLACK, half_m=0.07, low_m=-0.07, high_m=0.07),
        sheet(apex_m, facing_rad, _STEEL, half_m=0.04, low_m=-0.06, high_m=0.0),
    ]


def _metal(apex_m: Vector3, facing_rad: float) -> list[Facet]:
    """Return a bare sheet of 0.24 m that mirrors the ground below and the sky above."""
    return [
        sheet(apex_m, facing_rad, (0.4 + 2.5 * high_m) * _STEEL, half_m=0.12, low_m=high_m - 0.04, high_m=high_m)
        for high_m in (-0.08, -0.04, 0.0, 0.04, 0.08, 0.12)
    ]


def _tube(apex_m: Vector3, facing_rad: float) -> list[Facet]:
    """Return a light tube from the ground up, with a dark box of 0.2 m on it."""
    return [
        sheet(apex_m, facing_rad, _WHITE, half_m=0.025, low_m=-float(apex_m[2]), high_m=0.0),
        sheet(apex_m, facing_rad, _BLACK, half_m=0.1, low_m=-0.1, high_m=0.1),
        sheet(apex_m, facing_rad, _STEEL, half_m=0.05, low_m=-0.08, high_m=0.08),
    ]


LOOKS: dict[str, Facets] = {
    "white board": _board,
    "bare metal sheet": _metal,
    "on a tube": _tube,
}


@dataclass(frozen=True, slots=True, eq=False)
class Look(FrameRenderer):
    """Draws other facets in place of the reflector's."""

    facets: Facets = _board

    def reflector(
        self, apex_m: Vector3, facing_rad: float, *, at_rest: bool, rests_at_m: float
    ) -> tuple[tuple[Capsule, ...], list[Facet]]:
        """Return the stand of a reflector and its facets."""
        stand, _ = FrameRenderer.reflector(self, apex_m, facing_rad, at_rest=at_rest, rests_at_m=rests_at_m)
        return stand, self.facets(apex_m, facing_rad)


def draw_with_look(seed: int, look: str) -> Drawn:
    """Simulate the small case of a seed with a reflector of another look."""
    return draw_small(seed, partial(Look, facets=LOOKS[look]))


def main() -> None:
    """Print a row per look, then how often proposals of a confidence are on the reflector."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proposing.looks", description=__doc__)
    parser.add_argument("--first", type=int, default=40_000, help="seed of the first recording")
    parser.add_argument("--draws", type=int, default=10, help="recordings of each look")
    given = parser.parse_args()
    borne_out: dict[float, list[bool]] = {low: [] for low in _BINS}
    for look in LOOKS:
        right, beside, of = 0, 0, 0
        for seed in range(given.first, given.first + given.draws):
            try:
                drawn = draw_with_look(seed, look)
            except OptionError:
                continue
            views = dwell_views(drawn.placements, drawn.frames, drawn.recording.camera)
            clicked = after_one_click(every_dwell(views), views, drawn)
            if clicked is None:
                continue
            of += len({true.id for view in views if (true := true_placement(view.placement, drawn.recording))}) - 1
            for one in clicked.proposals.ranked:
                truth = true_placement(one.placement, drawn.recording)
                good = truth is not None and on_the_reflector(one, truth, drawn)
                borne_out[max(low for low in _BINS if one.confidence >= low)].append(good)
                right, beside = right + good, beside + (not good)
        print(f"{look}: {right} of {of} on the reflector after one click, {beside} elsewhere", flush=True)
    for low, good in borne_out.items():
        print(f"confidence from {low}: {sum(good)} of {len(good)} on the reflector")


def every_dwell(views: Sequence[DwellView]) -> Proposals:
    """Return all dwells as proposals: the person clicks the first at which a reflector stands."""
    unseen = np.full(2, np.nan)
    return Proposals(tuple(Proposal(view.placement, view.image_time, unseen, 1.0, 1.0, ()) for view in views))


if __name__ == "__main__":
    main()
