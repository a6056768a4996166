"""Everything that one 3D view shows at one moment, and what the page draws over it and can pick there, as a message."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Values
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, PairResult
from cocalib.session.state import Session
from cocalib.view.model import PlacementState, View
from cocalib.view.placement_states import SeenPlacements, placement_states, placements_of_clicks
from cocalib.view.reference import Reference, shown_calibration
from cocalib.view.wording import plain
from cocalib.web.frames import Frame
from cocalib.web.messages.space_messages import (
    RadarMap,
    SpaceFrame,
    SpaceLabel,
    SpacePlacement,
    SpaceReflector,
    SpaceReturn,
)
from cocalib.web.radar_sight import Returns, pixels_of
from cocalib.web.view3d.extent import ring_ranges_m
from cocalib.web.view3d.returns import SIZES, Colouring, size_classes


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """Everything that one 3D view shows at one moment.

    Attributes:
        number: of this drawing; rises by one each time.
        index: of the frame.
        session: with the latest answer.
        view: of the same session.
        selected: id of the selected click; None without one.
        returns: of the nearest scan, or of the last seconds.
        trail_s: how long returns stay; 0 for one scan.
        window: static returns around the selected click.
        image: a thumbnail of the frame; None when it cannot be read, or without images.
        camera: the recording's intrinsics, used until there is a calibration; None without images.
        has_images: whether there is a camera to show.
        colouring: what the colours of returns mean, with the extent of the data.
        placements: found in the whole recording.
        map: of the static returns of the whole recording; None until it is known, or if it is not to be drawn.
        reference: a calibration to show until there is a new one; None if there is none.
    """

    number: int
    index: int
    session: Session
    view: View
    selected: str | None
    returns: Returns
    trail_s: float
    window: Returns
    image: Frame | None
    camera: Camera | None
    has_images: bool
    colouring: Colouring
    placements: Sequence[Placement] = ()
    map: RadarMap | None = None
    reference: Reference | None = None

    @property
    def calibration(self) -> Calibration | None:
        """The calibration that places the camera; None before there is one."""
        return shown_calibration(self.session, self.reference)

    @property
    def errors(self) -> RadarErrors:
        """The radar's estimated errors, which are taken out of all positions."""
        return self.calibration.radar_errors if self.calibration else RadarErrors()

    def placements_m(self) -> Points3:
        """Return where the placements (n, 3) truly are."""
        positions = np.array([placement.position_radar_m for placement in self.placements]).reshape(-1, 3)
        return self.errors.corrected(positions)

    def placement_states(self) -> tuple[PlacementState, ...]:
        """Say what became of each placement."""
        of_clicks = placements_of_clicks(self.session, self.placements)
        return placement_states(self.session, SeenPlacements(tuple(self.placements)), of_clicks)


def true_positions(calibration: Calibration, pairs: Sequence[PairResult]) -> Points3:
    """Return where the radar's positions of some pairs (n, 3) truly are: its estimated errors are taken out."""
    return calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3))


_MOST_RETURNS = 3000
"""So many returns can be picked; of more, every other or every tenth and so on."""
_MOST_IN_WINDOW = 1000


def space_frame(sight: Sight) -> SpaceFrame:
    """Describe a Sight for the page."""
    calibration = sight.calibration
    solved = sight.session.outcome
    pairs = solved.pairs if isinstance(solved, Calibration) else ()
    return SpaceFrame(
        number=sight.number,
        index=sight.index,
        returns=_coloured_returns(sight, sight.returns.thinned(_MOST_RETURNS)),
        window=_coloured_returns(sight, sight.window.thinned(_MOST_IN_WINDOW)),
        reflectors=tuple(_reflectors(solved, pairs)) if isinstance(solved, Calibration) else (),
        placements=_placements(sight),
        labels=tuple(_labels(sight)),
        rings_m=ring_ranges_m(sight.colouring.extent.range_m),
        ground_m=round(ground_m(sight), 3),
        range_m=round(sight.colouring.extent.range_m, 3),
        legend=sight.colouring.legend(),
        projected=calibration is not None,
    )


def ground_m(sight: Sight) -> float:
    """Return the height at which the rings lie: of the lowest inlier, or at most that of the radar."""
    calibration = sight.calibration
    inliers = tuple(pair for pair in calibration.pairs if pair.inlier) if calibration else ()
    return float(min([0.0, *true_positions(calibration, inliers)[:, 2].tolist()])) if calibration else 0.0


def _coloured_returns(sight: Sight, returns: Returns) -> tuple[SpaceReturn, ...]:
    """Return returns with their colours and sizes."""
    colours = ("#{:02x}{:02x}{:02x}".format(*colour) for colour in sight.colouring.of(returns, sight.trail_s))
    sizes = (SIZES[number] for number in size_classes(returns.snr_db, sight.colouring.snr_db))
    seen = returns.messages(pixels_of(sight.calibration, returns.points_m))
    return tuple(map(SpaceReturn, seen, colours, sizes))


def _reflectors(calibration: Calibration, pairs: tuple[PairResult, ...]) -> Iterator[SpaceReflector]:
    points = true_positions(calibration, pairs)
    for pair, point, pixel in zip(pairs, points, pixels_of(calibration, points), strict=True):
        yield SpaceReflector(pair.id, _rounded(point), _pixel(pixel))


def _placements(sight: Sight) -> tuple[SpacePlacement, ...]:
    points = sight.placements_m()
    rows = zip(points, pixels_of(sight.calibration, points), sight.placement_states(), strict=True)
    return tuple(SpacePlacement(_rounded(point), _pixel(pixel), state) for point, pixel, state in rows)


def _labels(sight: Sight) -> Iterator[SpaceLabel]:
    """Yield the words at points: the selected pair, and the best next placement."""
    solved, advice = sight.session.outcome, sight.view.advice
    if isinstance(solved, Calibration):
        for pair in solved.pairs:
            if pair.id == sight.selected:
                words = f"{pair.id}: {np.linalg.norm(pair.point_radar_m):.1f} m, {_residual(pair)}"
                yield SpaceLabel(words, _rounded(true_positions(solved, (pair,))[0]), "selected")
    if advice is not None and not (advice.best.may_stop or sight.view.verdict.done):
        yield SpaceLabel(f"next {advice.range_m:.1f} m", _rounded(advice.best.position_radar_m), "next")


def _residual(pair: PairResult) -> str:
    return f"{plain(pair.distance_px)} px" if np.isfinite(pair.distance_px) else "behind the camera"


def _pixel(pixel: Values) -> tuple[float, float] | None:
    return (round(float(pixel[0]), 2), round(float(pixel[1]), 2)) if np.isfinite(pixel).all() else None


def _rounded(point: Values) -> tuple[float, float, float]:
    x_m, y_m, z_m = point.tolist()
    return round(x_m, 3), round(y_m, 3), round(z_m, 3)
