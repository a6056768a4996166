"""A calibration from a file, for review: shown until the clicks give a new one, then compared with it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.check.agreement import Comparison, compare
from calib_core.interchange.check.pixel_differences import PixelDifference
from calib_core.interchange.format import imported
from calib_core.results import Calibration
from cocalib.session.state import Session
from cocalib.view.model import Figure
from cocalib.view.wording import plain, with_sigma


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """A calibration given at the start.

    Attributes:
        name: of its file.
        calibration: the pose in it, with the camera of the recording.
    """

    name: str
    calibration: Calibration


def shown_calibration(session: Session, reference: Reference | None) -> Calibration | None:
    """Return the calibration to draw with: the session's own, else the reference's, else None."""
    if isinstance(session.outcome, Calibration):
        return session.outcome
    return reference.calibration if reference else None


def reference_words(session: Session, reference: Reference) -> str:
    """Return the status text: the reference is shown, and, once there are clicks, how far they are from it."""
    distances_px = [pair.distance_px for pair in session.checked if np.isfinite(pair.distance_px)]
    if not distances_px:
        return f"Showing the calibration from {reference.name}; click reflectors to check or replace it"
    count = len(distances_px)
    which = "residual of 1 click" if count == 1 else f"mean residual of {count} clicks"
    return f"Showing the calibration from {reference.name}; {which}: {plain(float(np.mean(distances_px)))} px"


@lru_cache(maxsize=4)
def comparison_figures(reference: Reference, calibration: Calibration) -> tuple[Figure, ...]:
    """Return how far the solved calibration is from the reference: in degrees, centimeters, and pixels by distance."""
    both = compare(imported(CalibrationFile(reference.calibration)), imported(CalibrationFile(calibration)))
    return (
        Figure(
            "rotation_apart",
            "rotation",
            with_sigma(both.rotation_deg, both.rotation_sigma_deg),
            "°",
            f"Angle between the solved rotation and the one from {reference.name}, ± the standard deviation of this "
            "difference according to the known covariances.",
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
    expected = f" The covariances predict {plain(at.sigma_px)} px." if known else ""
    return Figure(
        f"apart_{at.distance_m:g}_m",
        f"at {at.distance_m:g} m",
        f"{plain(at.rms_px)}",
        "px",
        f"Distance in the image between the two reprojections of a point {at.distance_m:g} m away: root mean square "
        f"over the image, {plain(at.max_px)} px at most.{expected}",
        "warning" if known and at.rms_px > 3 * at.sigma_px else "plain",
    )


def _chance(both: Comparison) -> tuple[Figure, ...]:
    if both.change is None:
        return ()
    words = "Probability of a difference this large if both are right and independent."
    return (Figure("apart_chance", "probability", plain(both.change.p_value, 2), "", words),)
