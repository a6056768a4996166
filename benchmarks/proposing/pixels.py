"""What is right about proposals, counted: pixels within 3 px, wrong ones, sigmas that cover."""

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.drawn import Drawn, true_placement
from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, ReflectorClick
from calib_core.proposing import Proposal
from calib_core.synthetic.scene.stage import SimulatedPlacement

__all__ = [
    "click_on_the_reflector",
    "off_px",
    "on_the_reflector",
    "placement_figures",
    "proposal_figures",
]

_RIGHT_PX = 3.0
_REFLECTOR_M = 0.24
_END_S = 0.3
_COVERED = 1.96
_SURE = 0.9


def off_px(proposal: Proposal, truth: SimulatedPlacement) -> np.ndarray:
    """Return the error of a proposal's pixel."""
    return np.asarray(proposal.pixel_px - truth.pixel_px)


def on_the_reflector(proposal: Proposal, truth: SimulatedPlacement, drawn: Drawn) -> bool:
    """Return whether a person sees the mark on the reflector, near its apex: within half of its width."""
    return bool(np.linalg.norm(off_px(proposal, truth)) <= _reach_px(truth, drawn))


def click_on_the_reflector(click: ReflectorClick, drawn: Drawn) -> bool:
    """Return the same of a click, which may lie on any reflector that stands at its time."""
    pixel_px = np.array([click.u_px, click.v_px])
    standing = [one for one in drawn.recording.placements if one.start <= click.image_time <= one.end]
    return any(float(np.linalg.norm(pixel_px - one.pixel_px)) <= _reach_px(one, drawn) for one in standing)


def _reach_px(truth: SimulatedPlacement, drawn: Drawn) -> float:
    range_m = float(np.linalg.norm(truth.position_radar_m))
    half_px = 0.5 * _REFLECTOR_M / range_m * float(drawn.recording.camera.matrix_px[0, 0])
    return max(_RIGHT_PX, half_px)


def placement_figures(drawn: Drawn) -> Figures:
    """Count the placements that the radar shows, and the ends of dwells that it shows within 0.3 s."""
    matched = [(one, truth) for one in drawn.placements if (truth := true_placement(one, drawn.recording)) is not None]
    ahead_ns = drawn.recording.stage.profile.latency_s * NS_PER_S
    ends_s = [
        abs(float(shown - ahead_ns - true)) / NS_PER_S
        for one, truth in matched
        for shown, true in ((one.start, truth.start), (one.end, truth.end))
    ]
    return {
        "placements": float(len(drawn.recording.placements)),
        "found": float(len({truth.id for _, truth in matched})),
        "invented": float(len(drawn.placements) - len(matched)),
        "ends": float(len(ends_s)),
        "ends within": float(np.sum(np.array(ends_s) <= _END_S)),
    }


def proposal_figures(
    name: str, proposals: Sequence[Proposal], drawn: Drawn, *, clicked: Iterable[Placement] = ()
) -> Figures:
    """Count proposals by what they are.

    Args:
        name: before the names of the figures.
        proposals: at most one per placement.
        drawn: with the truth.
        clicked: placements that a person clicked; they are right, and not proposed.
    """
    right = {truth.id for one in clicked if (truth := true_placement(one, drawn.recording)) is not None}
    counted = len(right)
    beyond = nowhere = sure = surely_nowhere = 0
    scaled: list[float] = []
    errors: list[float] = []
    for one in proposals:
        sure += one.confidence >= _SURE
        truth = true_placement(one.placement, drawn.recording)
        if truth is None or not on_the_reflector(one, truth, drawn):
            nowhere += 1
            surely_nowhere += one.confidence >= _SURE
        if truth is None or np.linalg.norm(off_px(one, truth)) > _RIGHT_PX:
            beyond += 1
        else:
            right.add(truth.id)
        if truth is not None and on_the_reflector(one, truth, drawn):
            scaled += (off_px(one, truth) / one.sigma_px).tolist()
            errors.append(float(np.linalg.norm(off_px(one, truth))))
    return {
        f"{name} right": float(len(right)),
        f"{name} clicked": float(counted),
        f"{name} proposed": float(len(proposals)),
        f"{name} beyond": float(beyond),
        f"{name} nowhere": float(nowhere),
        f"{name} sure": float(sure),
        f"{name} surely nowhere": float(surely_nowhere),
        f"{name} axes": float(len(scaled)),
        f"{name} covered": float(np.sum(np.abs(scaled) <= _COVERED)),
        f"{name} squares": float(np.sum(np.square(scaled))),
        f"{name} median px": float(np.median(errors)) if errors else None,
    }
