"""What is proposed where no reflector is to be found: `python -m benchmarks.proposing.decoys` prints a table.

Small recordings, proposed for without a click as `cocalib solve --propose` does, other widths included. A person goes from place
to place and stands there with a box or with nothing, and the radar sees the person alone; others walk and stop; the images of
another recording stand for those of the radar's placements, in order of time; the last row has a reflector.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.proposing.drawn import Drawn, drawn_from, true_placement
from benchmarks.proposing.looks import Look, sheet
from benchmarks.proposing.pixels import on_the_reflector
from benchmarks.proposing.small import draw_small, quick_frames, small_case
from benchmarks.proposing.without_reflector import without_reflector
from calib_core.arrays import Vector3
from calib_core.errors import OptionError
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.synthetic.options import Surroundings, Traffic
from calib_core.synthetic.recording import simulate
from calib_core.synthetic.rendering.frames import FrameRenderer
from calib_core.synthetic.rendering.reflector import Facet
from calib_core.synthetic.scene.person import Capsule
from cocalib.proposing import find_proposals

__all__ = ["DECOYS", "main"]

_PLACEMENTS = 8
_BROWN = np.array([0.15, 0.25, 0.4], dtype=np.float32)
_SURE = 0.9


class _Box(Look):
    """Draws a box of 0.4 m that stands on the ground in place of the reflector."""

    def reflector(
        self, apex_m: Vector3, facing_rad: float, *, at_rest: bool, rests_at_m: float
    ) -> tuple[tuple[Capsule, ...], list[Facet]]:
        low_m = -rests_at_m if at_rest else -0.2
        return (), [sheet(apex_m, facing_rad, _BROWN, half_m=0.2, low_m=low_m, high_m=low_m + 0.4)]


def _with_nothing(seed: int, renderer: Callable[..., FrameRenderer] | None = None) -> Drawn:
    case = small_case(seed)
    case = replace(
        case, options=replace(case.options, radar="imaging", placements=_PLACEMENTS, dwell_s=6.0, radar_rate_hz=10.0)
    )
    recording = simulate(case.options)
    empty_handed = without_reflector(recording)
    frames = quick_frames(empty_handed) if renderer is None else quick_frames(recording, renderer)
    return drawn_from(empty_handed, case, None, frames)


def _walkers(seed: int) -> Drawn:
    case = small_case(seed)
    crowd = Surroundings(passers_by=6)
    options = replace(case.options, scene="field", placements=0, surroundings=crowd, traffic=Traffic(walkers=4))
    recording = simulate(options)
    return drawn_from(recording, replace(case, options=options), None, quick_frames(recording))


def _of_another(seed: int) -> Drawn:
    own, other = draw_small(4 * seed), draw_small(4 * seed + 2_000)
    moved = tuple(
        replace(seen, start=shown.start, end=shown.end)
        for seen, shown in zip(other.placements, own.placements, strict=False)
    )
    return replace(own, placements=moved)


DECOYS: dict[str, Callable[[int], Drawn]] = {
    "a person with a box": partial(_with_nothing, renderer=_Box),
    "a person with nothing": _with_nothing,
    "people who walk and stop": _walkers,
    "images of another recording": _of_another,
}
_KINDS = DECOYS | {"a reflector": draw_small}


def main() -> None:
    """Print a row per kind: recordings, proposals, and of a reflector how many are right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proposing.decoys", description=__doc__)
    parser.add_argument("--first", type=int, default=50_000, help="seed of the first recording of each kind")
    parser.add_argument("--draws", type=int, default=10, help="recordings of each kind")
    given = parser.parse_args()
    print("| recordings of | number | placements | proposed | right | surer than 0.9 | right of these |")
    print("|---|---|---|---|---|---|---|")
    for kind, draw in _KINDS.items():
        drawn = (_counts(draw, seed) for seed in range(given.first, given.first + given.draws))
        rows = [row for row in drawn if row is not None]
        total = np.sum(rows, axis=0, dtype=int)
        right = total[[2, 4]].tolist() if kind == "a reflector" else ["0", "0"]
        print(f"| {kind} | {len(rows)} | {total[0]} | {total[1]} | {right[0]} | {total[3]} | {right[1]} |", flush=True)


def _counts(draw: Callable[[int], Drawn], seed: int) -> tuple[int, ...] | None:
    """Return the number of placements, proposals, right ones, sure ones and right sure ones; None if nothing can be drawn."""
    try:
        drawn = draw(seed)
    except OptionError:
        return None
    camera, options = drawn.recording.camera, CalibrationOptions()
    found = find_proposals(drawn.frames, camera, options, placements=drawn.placements)  # type: ignore[arg-type]
    if isinstance(found, Unsolvable):
        return len(drawn.placements), 0, 0, 0, 0
    right = [
        (truth := true_placement(proposal.placement, drawn.recording)) is not None
        and on_the_reflector(proposal, truth, drawn)
        for proposal in found[1].ranked
    ]
    sure = [good for proposal, good in zip(found[1].ranked, right, strict=True) if proposal.confidence > _SURE]
    return len(drawn.placements), len(right), sum(right), len(sure), sum(sure)


if __name__ == "__main__":
    main()
