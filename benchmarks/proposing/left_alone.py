"""What the machine accepts when it is left alone: on recordings, and on images and radar that do not belong together."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.cases import case_of
from benchmarks.proposing.drawn import Drawn, draw, true_placement
from benchmarks.proposing.pixels import click_on_the_reflector
from benchmarks.proposing.solving import pose_figures
from calib_core.camera import Camera
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import DwellView, Proposals, dwell_views, proposals_of
from calib_core.proposing.automatic import automatic_clicks
from cocalib.solving.automatic import refusal_of

__all__ = ["automatic_figures", "measure_mismatched"]

_NO_IMAGE = np.zeros((0, 0, 3), dtype=np.uint8)


def automatic_figures(proposals: Proposals, views: Sequence[DwellView], drawn: Drawn) -> Figures:
    """Calibrate without a person, as `solve --auto` does, and compare with the true pose.

    "auto refused" is 1 if there is no answer; like the command, this refuses poses, too.
    """
    outcome = automatic_clicks(proposals, len(views))
    if isinstance(outcome, Unsolvable):
        return {"auto refused": 1.0}
    pose = pose_figures("auto", outcome.clicks, drawn, refuses=lambda one: refusal_of(one) is not None)
    wrong = sum(not click_on_the_reflector(click, drawn) for click in outcome.clicks)
    refused = float("auto rotation_rad" not in pose)
    return pose | {"auto refused": refused, "auto confidence": outcome.confidence, "auto wrong clicks": float(wrong)}


def measure_mismatched(folder: Path, first: int, recordings: int, trial: int) -> Figures:
    """Give the machine what the radar saw in one recording and the images of another, or of other dwells of its own.

    The dwells are matched in order of time, so that images show a reflector for every dwell: a harder case than dwells
    whose images show nothing. Every fourth trial takes a recording's own images, some dwells later.

    Args:
        folder: where frames are kept.
        first: seed of the first recording.
        recordings: how many there are to be mixed.
        trial: number of the draw.
    """
    cv2.setNumThreads(1)
    rng = np.random.default_rng([first, trial, 18])
    seeds = rng.choice(recordings, 2, replace=False) + first
    images, camera = _views(folder, int(seeds[0]))
    radar = images if trial % 4 == 0 else _views(folder, int(seeds[1]))[0]
    count = min(len(images), len(radar))
    if count < 2:
        return {}
    shift = int(rng.integers(1, count)) if trial % 4 == 0 else 0
    mixed = tuple(_seen_at(images[i], radar[(i + shift) % count]) for i in range(count))
    proposals = proposals_of(mixed, camera, CalibrationOptions())
    outcome = automatic_clicks(proposals, len(mixed))
    accepted = not isinstance(outcome, Unsolvable)
    return {
        "own": float(trial % 4 == 0),
        "accepted": float(accepted),
        "agreement": 0.0 if proposals.agreement is None else proposals.agreement.share,
        "confidence": 0.0 if isinstance(outcome, Unsolvable) else outcome.confidence,
    }


@cache
def _views(folder: Path, seed: int) -> tuple[tuple[DwellView, ...], Camera]:
    """Return what the images of a recording show at the dwells that are real, without the images."""
    drawn = draw(case_of(seed), folder)
    views = dwell_views(drawn.placements, drawn.frames, drawn.recording.camera)
    real = [view for view in views if true_placement(view.placement, drawn.recording) is not None]
    return tuple(replace(view, image=_NO_IMAGE, stills=()) for view in real), drawn.recording.camera


def _seen_at(images: DwellView, radar: DwellView) -> DwellView:
    position_radar_m = radar.placement.position_radar_m
    return replace(images, placement=replace(images.placement, position_radar_m=position_radar_m))
