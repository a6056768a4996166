"""Poses from clicks that a person made, accepted, or left to the machine."""

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.accuracy.outcomes import outcome_figures, quantile_999, solved_or_refused
from benchmarks.accuracy.rows import Figures
from benchmarks.proposing.drawn import Drawn, true_placement
from benchmarks.proposing.pixels import on_the_reflector
from calib_core.calibration import calibrate
from calib_core.measurements import ReflectorClick
from calib_core.options import CalibrationOptions
from calib_core.proposing import Proposal
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on

__all__ = ["accepted_clicks", "pose_figures"]

_KEPT = ("rotation_rad", "position_m")
_FAR = 2.0
_TURNED_RAD = np.radians(5.0)


def accepted_clicks(proposals: Sequence[Proposal], drawn: Drawn) -> tuple[ReflectorClick, ...]:
    """Accept what a person sees on the reflector, and reject the rest."""
    accepted = []
    for number, one in enumerate(proposals):
        truth = true_placement(one.placement, drawn.recording)
        if truth is not None and on_the_reflector(one, truth, drawn):
            u_px, v_px = one.pixel_px.tolist()
            accepted.append(
                ReflectorClick(one.image_time, f"p{number + 1}", u_px, v_px, sigma_px=one.sigma_px, mark="snapped")
            )
    return tuple(accepted)


def pose_figures(
    name: str,
    clicks: Sequence[ReflectorClick],
    drawn: Drawn,
    *,
    refuses: Callable[[Calibration], bool] = lambda _: False,
) -> Figures:
    """Calibrate, and compare with the true pose; there are no figures of an answer that is refused.

    "far" is 1 if the answer is confidently wrong: the truth is outside twice the stated 99.9 % quantile, or more than 5 deg
    away although the verdict is good or usable. A weak verdict states how far off the answer may be.
    """
    if not clicks:
        return {f"{name} clicks": 0.0}
    scans, camera = drawn.scans, drawn.recording.camera
    outcome = solved_or_refused(lambda: calibrate(clicks, scans, camera, CalibrationOptions(), background=scans))
    if isinstance(outcome, Calibration) and refuses(outcome):
        return {f"{name} clicks": float(len(clicks))}
    figures = outcome_figures(outcome, drawn.recording.stage.camera_from_reported)
    found: Figures = {f"{name} {key}": value for key, value in figures.items() if key in _KEPT}
    squared, quantile, turned = figures.get("squared"), figures.get("quantile"), figures.get("rotation_rad")
    outside = squared is not None and quantile is not None and not squared <= _FAR * quantile_999(quantile)
    relied_on = isinstance(outcome, Calibration) and verdict_on(outcome).level in ("good", "usable")
    far = outside or (relied_on and turned is not None and turned > _TURNED_RAD)
    return found | {f"{name} clicks": float(len(clicks)), f"{name} far": float(far)}
