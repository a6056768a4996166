"""What a part of proposing is worth: `python -m benchmarks.proposing.ablation` leaves out one at a time, on small recordings."""

import argparse
from collections.abc import Sequence
from importlib import import_module
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.proposing.clicking import after_one_click
from benchmarks.proposing.drawn import Drawn
from benchmarks.proposing.pixels import placement_figures, proposal_figures
from benchmarks.proposing.small import draw_small
from calib_core.errors import OptionError
from calib_core.options import CalibrationOptions
from calib_core.proposing import dwell_views, proposals_of

__all__ = ["main"]

_RESPONSE = import_module("calib_core.proposing.dwell_views")._response
_PARTS: dict[str, tuple[tuple[str, str, Any], ...]] = {
    "nothing": (),
    "limbs and bodies beside a place": (
        ("dwell_views", "_of_a_larger_thing", lambda change, *_: np.zeros_like(change)),
    ),
    "a part of the reflector": (("dwell_views", "_PART_COUNTS", 0.0),),
    "changes without the placement": (
        ("dwell_views", "_response", lambda own, _, width_px: _RESPONSE(own, own[:0], width_px)),
    ),
    "light that changes in parts": (("dwell_views", "local_light", lambda image, _: np.ones_like(image[..., :1])),),
    "apexes": (("dwell_views", "with_seen_apexes", lambda view, _: view),),
    "places that repeat or gather": (
        ("candidate_rays", "_REPEATED_SHARE", 0.0),
        ("candidate_rays", "_GATHERED_SHARE", 0.0),
    ),
    "weaker echoes": (("candidate_rays", "_WEAKER_DB", 1e9),),
    "echoes that pull aside": (("pose_agreement", "_WIDE_SHARE", 0.0),),
    "levels of noise": (("pose_agreement", "NOISE_LEVELS", (1.0,)),),
    "poses that clicks leave open": (("proposing", "clicks_agreement", lambda rays, _: 0.0 * rays.at_first().odds),),
    "people told from reflectors": (("proposing", "reflector_log_odds", lambda *_, **__: np.inf),),
}
"""Names, and what stands for each part in a module of `calib_core.proposing`."""
_FIGURES = ("placements", "without right", "without nowhere", "after right", "after nowhere")


def main() -> None:
    """Print a row per part: placements, and proposals that are right and wrong without a click and after one."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proposing.ablation", description=__doc__)
    parser.add_argument("--first", type=int, default=76_000, help="seed of the first recording")
    parser.add_argument("--draws", type=int, default=8, help="recordings")
    parser.add_argument("--parts", nargs="+", choices=_PARTS, default=list(_PARTS), metavar="PART", help="these only")
    given = parser.parse_args()
    drawn = []
    for seed in range(given.first, given.first + given.draws):
        try:
            drawn.append(draw_small(seed))
        except OptionError:
            continue
    print("| without | placements | right | wrong | right after a click | wrong |")
    print("|---|---|---|---|---|---|")
    for part in given.parts:
        print(f"| {part} | " + " | ".join(f"{count:.0f}" for count in _without(part, drawn)) + " |", flush=True)


def _without(part: str, drawn: Sequence[Drawn]) -> np.ndarray:
    patches = [
        patch.object(import_module(f"calib_core.proposing.{name}"), what, new) for name, what, new in _PARTS[part]
    ]
    for one in patches:
        one.start()
    counts = np.sum([_counts(one) for one in drawn], axis=0)
    for one in patches:
        one.stop()
    return np.asarray(counts)


def _counts(drawn: Drawn) -> list[float]:
    views = dwell_views(drawn.placements, drawn.frames, drawn.recording.camera)
    first = proposals_of(views, drawn.recording.camera, CalibrationOptions())
    clicked = after_one_click(first, views, drawn)
    rest, clicks = ((), []) if clicked is None else (clicked.proposals.ranked, [clicked.placement])
    figures = placement_figures(drawn) | proposal_figures("without", first.ranked, drawn)
    figures |= proposal_figures("after", rest, drawn, clicked=clicks)
    return [figures.get(name) or 0.0 for name in _FIGURES]


if __name__ == "__main__":
    main()
