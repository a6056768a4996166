"""What a part of proposing is worth: `python -m benchmarks.proposing.ablation` leaves out one at a time.

Simulated recordings of ten placements have one reflector or two; decoys are those of `benchmarks.proposing.decoys`, and
`--real FOLDER` adds the public set of two boards, clicked at one board of each scene in turn. Right is within 3 px, or 0.3 m on
the boards; wrong is what is not on the reflector.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks.proposing.clicking import after_one_click
from benchmarks.proposing.decoys import DECOYS
from benchmarks.proposing.drawn import Drawn, drawn_from
from benchmarks.proposing.looks import every_dwell
from benchmarks.proposing.pixels import proposal_figures
from benchmarks.proposing.small import quick_frames, small_case
from benchmarks.real.converters import BOARD_RANGES_M
from benchmarks.real.sets import SETS
from calib_core.association.placements import Placement, find_placements
from calib_core.camera import Camera
from calib_core.errors import OptionError
from calib_core.measurements import ReflectorClick, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, Proposal, dwell_views
from calib_core.proposing.still_images import StillImage, stack_median
from calib_core.recordings import open_recording
from calib_core.synthetic.recording import simulate
from cocalib.proposing import find_proposals, proposed_again

__all__ = ["main"]

_CORE = "calib_core.proposing."


def _one_still(number: int, placements: Sequence[Placement], seen: Any, times: np.ndarray) -> tuple[StillImage, ...]:
    shown = times[seen.numbers]
    standing = [i for i, one in enumerate(placements) if ((one.start <= shown) & (shown <= one.end)).any()]
    image = stack_median(seen.images)
    return (StillImage(image, frozenset(standing) | {number}, shown[len(shown) // 2]),)


_PARTS: dict[str, dict[str, Any]] = {
    "nothing": {},
    "limbs and bodies beside a place": {"dwell_views._of_a_larger_thing": lambda change, *_: np.zeros_like(change)},
    "a part of the reflector": {"dwell_views._PART_COUNTS": 0.0},
    "light that changes in parts": {"dwell_views.local_light": lambda image, _: np.ones_like(image[..., :1])},
    "a still for each set of placements": {"dwell_views.still_images": _one_still},
    "apexes of candidates": {"dwell_views.with_seen_apexes": lambda view, _: view},
    "odds of an apex": {"candidate_rays._APEX": 0.0, "image_candidates._APEX_GAIN": 1.0},
    "places that repeat": {"candidate_rays._REPEATED_SHARE": 0.0},
    "levels of noise": {"pose_agreement.NOISE_LEVELS": (1.0,)},
    "confidence that is tempered": {"proposing._TEMPER": 1.0},
    "places that others take": {"proposing._taken_by_others": lambda _, rays, __: rays.odds < 0.0},
    "people told by their echo": {"proposing.reflector_log_odds": lambda *_, **__: np.inf},
    "the width of what was clicked": {"appearance.width_seen_px": lambda view, _: view.width_px},
    "a look finer than a pixel": {"appearance._FINER": 1.0},
}
"""Names, and what stands for each part in modules of `calib_core.proposing`."""
_OF_IMAGES = ("dwell_views.", "image_candidates.", "still_images.")
_PLACEMENTS = 10
_SURE = 0.9
_BOARD_M = 0.3
_RANGE_M = 1.5
_COUNTS = (("without right", "without nowhere"), ("after right", "after nowhere"), ("sure", "surely nowhere"))
"""What is right and wrong without a click, after one, and of all that is surer than 0.9."""


@dataclass(frozen=True, slots=True, eq=False)
class _Subject:
    """A recording, and how to count what is proposed for it.

    Attributes:
        kind: of the recording.
        frames: of its camera.
        camera: the intrinsics.
        placements: as the radar shows them.
        count: (3, 2) right and wrong, as `_COUNTS` names them, of the views of all placements and of what is proposed.
    """

    kind: str
    frames: Any
    camera: Camera
    placements: tuple[Placement, ...]
    count: Callable[[Sequence[DwellView], Sequence[Proposal]], np.ndarray]


def _subjects(given: argparse.Namespace, scratch: Path) -> Iterator[_Subject]:
    if given.real is not None:
        yield _boards(given.real, scratch)
    kinds: list[tuple[str, int, Callable[[int], Drawn], Callable[..., np.ndarray]]] = [
        ("one reflector", given.draws, partial(_with_reflectors, 1), _count_drawn),
        ("two reflectors", given.draws, partial(_with_reflectors, 2), _count_drawn),
        *(("decoys", given.decoys, draw, _count_decoys) for draw in DECOYS.values()),
    ]
    for kind, draws, draw, count in kinds:
        for seed in range(given.first, given.first + draws):
            try:
                drawn = draw(seed)
            except OptionError:
                continue
            yield _Subject(kind, drawn.frames, drawn.recording.camera, drawn.placements, partial(count, drawn))


def _with_reflectors(reflectors: int, seed: int) -> Drawn:
    case = small_case(seed)
    case = replace(case, options=replace(case.options, placements=_PLACEMENTS, reflectors=reflectors))
    recording = simulate(case.options)
    return drawn_from(recording, case, None, quick_frames(recording))


def _count_drawn(drawn: Drawn, views: Sequence[DwellView], ranked: Sequence[Proposal]) -> np.ndarray:
    clicked = after_one_click(every_dwell(views), views, drawn)
    rest, marked = ((), []) if clicked is None else (clicked.proposals.ranked, [clicked.placement])
    found = proposal_figures("without", ranked, drawn) | proposal_figures("after", rest, drawn, clicked=marked)
    for name in _COUNTS[2]:
        found[name] = sum(found[f"{when} {name}"] or 0.0 for when in ("without", "after"))
    return np.array([[found[name] for name in pair] for pair in _COUNTS])


def _count_decoys(_drawn: Drawn, _views: Sequence[DwellView], ranked: Sequence[Proposal]) -> np.ndarray:
    sure = sum(one.confidence > _SURE for one in ranked)
    return np.array([[0, len(ranked)], [0, 0], [sure, sure]])


def _boards(data: Path, scratch: Path) -> _Subject:
    """Return the public set of two boards in each scene; the recording stays open."""
    contents = SETS["two-reflectors"].contents(data, scratch)
    camera, path = contents.camera, contents.recording
    assert camera is not None, "given by its converter"
    assert path is not None, "written by its converter"
    recording = open_recording([path])
    placements = find_placements(recording.radar_scans(), CalibrationOptions().gating)
    count = partial(_count_boards, recording, camera, contents.clicks)
    return _Subject("boards", recording, camera, placements, count)


def _count_boards(
    frames: Any,
    camera: Camera,
    clicks: Sequence[ReflectorClick],
    views: Sequence[DwellView],
    ranked: Sequence[Proposal],
) -> np.ndarray:
    def shown(proposal: Proposal) -> str:
        """Return the click that a proposal repeats; "" if there is none."""
        placement = proposal.placement
        for click, range_m in zip(clicks, BOARD_RANGES_M, strict=True):
            off_px = np.hypot(*(proposal.pixel_px - [click.u_px, click.v_px]))
            near = off_px <= _BOARD_M / range_m * camera.matrix_px[0, 0]
            off_m = abs(np.linalg.norm(placement.position_radar_m) - range_m)
            if near and off_m < _RANGE_M and placement.start <= click.image_time <= placement.end:
                return click.id
        return ""

    def counted(proposals: Sequence[Proposal], clicked: str = "") -> list[int]:
        right = [shown(one) for one in proposals]
        return [len(set(right) - {"", clicked}), right.count("")]

    after, sure = [], [one for one in ranked if one.confidence > _SURE]
    for click in clicks[::2]:
        _, again = proposed_again(views, frames, camera, CalibrationOptions(), confirmed=(click,))
        after.append(counted(again.ranked, click.id))
        sure += [one for one in again.ranked if one.confidence > _SURE]
    wrong = counted(sure)[1]
    return np.array([counted(ranked), np.sum(after, axis=0), [len(sure), wrong]])


def main() -> None:
    """Print a row per part: how many proposals are right / wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.proposing.ablation", description=__doc__)
    parser.add_argument("--first", type=int, default=81_000, help="seed of the first recording of each kind")
    parser.add_argument("--draws", type=int, default=8, help="recordings with one reflector, and with two")
    parser.add_argument("--decoys", type=int, default=0, help="recordings of each kind of decoy")
    parser.add_argument("--real", type=Path, help="folder of the checkouts of public sets")
    parser.add_argument("--parts", nargs="+", choices=_PARTS, default=list(_PARTS), metavar="PART", help="these only")
    parser.add_argument("--together", action="store_true", help="leave them all out at once")
    given = parser.parse_args()
    with TemporaryDirectory() as scratch:
        subjects = list(_subjects(given, Path(scratch)))
        _print_table([given.parts] if given.together else [[part] for part in given.parts], subjects)


def _print_table(rows: Sequence[Sequence[str]], subjects: Sequence[_Subject]) -> None:
    kinds = list(dict.fromkeys(one.kind for one in subjects))
    plain = [dwell_views(one.placements, one.frames, one.camera) for one in subjects]
    when = [name for kind in kinds for name in ([kind] if kind == "decoys" else [kind, "after a click"])]
    print("| without | " + " | ".join([*when, "surer than 0.9"]) + " |")
    print("|---" * (len(when) + 2) + "|", flush=True)
    for parts in rows:
        totals = _without(parts, subjects, plain)
        cells = [totals[kind][row] for kind in kinds for row in range(1 if kind == "decoys" else 2)]
        sure, wrong = sum(totals[kind][2] for kind in kinds)
        counts = [*(f"{right:.0f} / {wrong:.0f}" for right, wrong in cells), f"{sure - wrong:.0f} / {wrong:.0f}"]
        print(f"| {', '.join(parts)} | " + " | ".join(counts) + " |", flush=True)


def _without(
    parts: Sequence[str], subjects: Sequence[_Subject], plain: Sequence[tuple[DwellView, ...]]
) -> dict[str, np.ndarray]:
    """Return the counts (3, 2) by kind; views are made anew if a part is one of the images."""
    totals: dict[str, np.ndarray] = {}
    stand_ins = {name: instead for part in parts for name, instead in _PARTS[part].items()}
    with ExitStack() as stack:
        for name, instead in stand_ins.items():
            stack.enter_context(patch(_CORE + name, instead))
        for one, views in zip(subjects, plain, strict=True):
            own = views
            if any(name.startswith(_OF_IMAGES) for name in stand_ins):
                own = dwell_views(one.placements, one.frames, one.camera)
            found = _proposed(one, own)
            totals[one.kind] = totals.get(one.kind, 0) + one.count(own, found)
    return totals


def _proposed(subject: _Subject, views: tuple[DwellView, ...]) -> tuple[Proposal, ...]:
    with patch("cocalib.proposing.dwell_views", lambda *_, **__: views):
        options = CalibrationOptions()
        found = find_proposals(subject.frames, subject.camera, options, placements=subject.placements)
    return () if isinstance(found, Unsolvable) else found[1].ranked


if __name__ == "__main__":
    main()
