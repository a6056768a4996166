"""Solve a recording without a person: clicks are placed where images and radar agree, or there is no calibration."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from calib_core.association.pairing import RadarSource
from calib_core.camera import Camera
from calib_core.geometry import camera_position_jacobian
from calib_core.measurements import Facts, ReflectorClick, Unpaired, Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.proposing import ViewProgress
from calib_core.proposing.automatic import automatic_clicks
from calib_core.results import Calibration, UnconfirmedClicks
from calib_core.results.confirmation import unconfirmed_warning
from calib_core.results.verdict import verdict_on
from cocalib.proposing import REFLECTOR_M, RecordedFrames, find_proposals
from cocalib.solving.solving import solve_clicks

_FARTHEST_M = 0.3
"""Without a measured position, a camera that is certainly farther from the radar than this is not believed: whatever is carried
from place to place beside the reflector looks like a camera so far away."""


@dataclass(frozen=True, slots=True)
class PlacedClicks:
    """Clicks to solve with.

    Attributes:
        clicks: those that a person confirmed, and those that were placed automatically.
        unconfirmed: the latter.
        agreement: what their confidence rests on, as in `AutomaticClicks`; empty if none was placed.
    """

    clicks: tuple[ReflectorClick, ...]
    unconfirmed: UnconfirmedClicks | None
    agreement: Facts = field(default_factory=dict)


def place_clicks(
    recording: RecordedFrames,
    camera: Camera | None,
    options: CalibrationOptions,
    *,
    confirmed: Sequence[ReflectorClick] = (),
    reflector_m: float = REFLECTOR_M,
    progress: Callable[[ViewProgress | str], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> PlacedClicks | Unsolvable:
    """Click a recording without a person.

    Args:
        recording: with a radar and a camera.
        camera: the intrinsics.
        options: of the calibration.
        confirmed: clicks that a person placed; they stay as they are.
        reflector_m: width of the reflector [m].
        progress: called with what is done next, in words, and while the images are looked at.
        stopped: asked often; once it is true there are no clicks.

    Raises:
        CalibrationError: the recording cannot be read.
    """
    found = find_proposals(
        recording,
        camera,
        options,
        confirmed=confirmed,
        reflector_m=reflector_m,
        progress=progress,
        stopped=stopped,
    )
    if isinstance(found, Unsolvable):
        return found
    views, proposals = found
    counting = [click for click in confirmed if click.counts]
    if not proposals.ranked and counting:
        return PlacedClicks(tuple(confirmed), None)
    placed = automatic_clicks(proposals, len(views), confirmed=counting)
    if isinstance(placed, Unsolvable):
        return placed
    clicks = _with_own_ids(placed.clicks, confirmed)
    unconfirmed = UnconfirmedClicks(tuple(click.id for click in clicks), placed.confidence)
    return PlacedClicks((*confirmed, *clicks), unconfirmed, placed.agreement)


def solve_placed_clicks(
    recording: RadarSource,
    placed: PlacedClicks,
    camera: Camera | None,
    options: CalibrationOptions,
) -> Calibration | Unsolvable:
    """Solve with clicks that nobody may have confirmed: a pose that these contradict is refused.

    Args:
        recording: where the radar scans come from.
        placed: the clicks.
        camera: the intrinsics.
        options: of the calibration.

    Raises:
        OptionError: an option is out of range.
        CalibrationError: the recording cannot be read at the clicks.
    """
    outcome = solve_clicks(recording, placed.clicks, camera, options)
    if isinstance(outcome, Unsolvable) or placed.unconfirmed is None:
        return outcome
    count = sum(click.counts for click in placed.clicks)
    warned = dataclasses.replace(outcome, warnings=(*outcome.warnings, unconfirmed_warning(placed.unconfirmed, count)))
    refusal = refusal_of(warned, outcome.unpaired)
    return warned if refusal is None else refusal


def refusal_of(calibration: Calibration, unpaired: tuple[Unpaired, ...] = ()) -> Unsolvable | None:
    """Say why a pose from clicks that nobody confirmed is not believed; None if it is.

    Args:
        calibration: from such clicks.
        unpaired: clicks without a radar position.
    """
    verdict = verdict_on(calibration)
    if verdict.level == "contradictory":
        return Unsolvable("not-confident", {"contradiction": verdict.cause}, unpaired)
    away_m = _least_distance_m(calibration)
    if calibration.options.solving.camera_position is None and away_m > _FARTHEST_M:
        return Unsolvable("not-confident", {"camera_away_m": away_m}, unpaired)
    return None


def _least_distance_m(calibration: Calibration) -> float:
    """Return how far the camera is from the radar at least [m], two standard deviations below the estimate."""
    pose = calibration.camera_from_radar
    centre_m = -pose.rotation.T @ pose.translation_m
    away_m = max(float(np.linalg.norm(centre_m)), 1e-9)
    along = camera_position_jacobian(pose).T @ (centre_m / away_m)
    return away_m - 2.0 * float(np.sqrt(along @ calibration.covariance @ along))


def _with_own_ids(clicks: Sequence[ReflectorClick], others: Sequence[ReflectorClick]) -> list[ReflectorClick]:
    """Rename the clicks whose id another one has."""
    taken = {click.id for click in others}
    renamed = []
    for click in clicks:
        name = click.id
        while name in taken:
            name = f"{name}-auto"
        taken.add(name)
        renamed.append(dataclasses.replace(click, id=name))
    return renamed
