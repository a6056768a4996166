"""A calibration from a file, to be looked at: shown until the clicks give one of their own, then compared with it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from app.session import Session
from app.view.model import Figure
from app.view.number_format import plain, with_sigma
from calib_core.interchange import CalibrationFile, Comparison, PixelDifference, compare, imported
from calib_core.results import Calibration

__all__ = ["Reference", "comparison_figures", "reference_words", "shown_calibration"]


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A calibration given at the start.

    Attributes:
        name: of its file.
        calibration: the pose in it, seen through the camera of the recording.
    """

    name: str
    calibration: Calibration


def shown_calibration(session: Session, reference: Reference | None) -> Calibration | None:
    """Return what the picture and the 3D view are drawn with: the session's own answer, else the reference, else nothing."""
    if isinstance(session.outcome, Calibration):
        return session.outcome
    return reference.calibration if reference else None


def reference_words(session: Session, reference: Reference) -> str:
    """Say that the reference is on the screen and, once there are clicks, how far they lie from it."""
    distances_px = [pair.distance_px for pair in session.checked if np.isfinite(pair.distance_px)]
    if not distances_px:
        return f"Showing the calibration from {reference.name}; click reflectors to check or replace it"
    count = len(distances_px)
    lie = "1 click lies" if count == 1 else f"{count} clicks lie"
    mean = "" if count == 1 else " on average"
    return (
        f"Showing the calibration from {reference.name}; {lie} {plain(float(np.mean(distances_px)))} px from it{mean}"
    )


@lru_cache(maxsize=4)
def comparison_figures(reference: Reference, calibration: Calibration) -> tuple[Figure, ...]:
    """Return how far the solved calibration lies from the reference: in degrees, centimetres, and pixels by distance."""
    both = compare(imported(CalibrationFile(reference.calibration)), imported(CalibrationFile(calibration)))
    return (
        Figure(
            "rotation_apart",
            "rotation",
            with_sigma(both.rotation_deg, both.rotation_sigma_deg),
            "deg",
            f"Angle between the solved rotation and the one from {reference.name}, ± the standard deviation of this "
            "difference by the covariances that are known.",
        ),
        Figure(
            "position_apart",
            "camera position",
            with_sigma(both.position_cm, both.position_sigma_cm),
            "cm",
            f"Distance between the solved camera position and the one from {reference.name}, ± the standard deviation "
            "of this difference.",
        ),
        *(_pixels(at) for at in both.pixels),
        *_chance(both),
    )


def _pixels(at: PixelDifference) -> Figure:
    known = np.isfinite(at.sigma_px)
    expected = f" By the covariances {plain(at.sigma_px)} px are to be expected." if known else ""
    return Figure(
        f"apart_{at.distance_m:g}_m",
        f"at {at.distance_m:g} m",
        f"{plain(at.rms_px)}",
        "px",
        f"How far apart the two project what is {at.distance_m:g} m away: root mean square over the image, "
        f"{plain(at.max_px)} px at most.{expected}",
        "warning" if known and at.rms_px > 3 * at.sigma_px else "plain",
    )


def _chance(both: Comparison) -> tuple[Figure, ...]:
    if not np.isfinite(both.p_value):
        return ()
    words = "Chance of a difference this large if both were right and independent."
    return (Figure("apart_chance", "chance", plain(both.p_value, 2), "", words),)
