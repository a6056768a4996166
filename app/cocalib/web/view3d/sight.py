"""Everything that one 3D view shows at one moment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Points3, Vector3
from calib_core.association.placements import Placement
from calib_core.camera import Camera
from calib_core.radar import RadarErrors
from calib_core.results import Calibration, PairResult
from cocalib.session import Session
from cocalib.view import Reference, View, shown_calibration
from cocalib.web.frames import Frame
from cocalib.web.messages import PlacementState, RadarMap, ReturnColour
from cocalib.web.view3d.colouring import Colouring
from cocalib.web.view3d.extent import Extent
from cocalib.web.view3d.returns import Returns

_SAME_PLACE_M = 1.0
"""Of two placements at one time, a pair belongs to the one this close to its return."""


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
        picture: a thumbnail of the frame; None when it cannot be read, or without pictures.
        camera: the recording's intrinsics, used until there is a calibration; None without pictures.
        has_pictures: whether there is a camera to show.
        extent: of the data.
        placements: found in the whole recording.
        map: of the static returns of the whole recording; None until it is known, or if it is not to be drawn.
        snr_db: ends of the sizes and colours of amplitudes; None if the radar has none.
        fastest_mps: end of the colours of Doppler.
        colour: what the colours of returns mean.
        reference: a calibration to show until there is a new one; None if there is none.
        light: drawn on a light background.
    """

    number: int
    index: int
    session: Session
    view: View
    selected: str | None
    returns: Returns
    trail_s: float
    window: Returns
    picture: Frame | None
    camera: Camera | None
    has_pictures: bool
    extent: Extent
    placements: Sequence[Placement] = ()
    map: RadarMap | None = None
    snr_db: tuple[float, float] | None = None
    fastest_mps: float = 1.0
    colour: ReturnColour = "speed"
    reference: Reference | None = None
    light: bool = False

    @property
    def calibration(self) -> Calibration | None:
        """The calibration that places the camera; None before there is one."""
        return shown_calibration(self.session, self.reference)

    @property
    def errors(self) -> RadarErrors:
        """The radar's estimated errors, which are taken out of all positions."""
        return self.calibration.radar_errors if self.calibration else RadarErrors()

    @property
    def colouring(self) -> Colouring:
        """What the colours of returns mean."""
        return Colouring(self.colour, self.extent, self.snr_db, self.fastest_mps, self.light)

    def placement_states(self) -> tuple[PlacementState, ...]:
        """Say of each placement whether it has a click, or was dismissed."""
        outcome = self.session.outcome
        pairs = outcome.pairs if isinstance(outcome, Calibration) else ()
        points = {pair.id: pair.point_radar_m for pair in pairs}
        clicks = [(int(click.image_time), points.get(click.id)) for click in self.session.clicks]
        dismissed = [(int(one.time), np.array(one.position_m)) for one in self.session.dismissed]
        return tuple(
            "dismissed" if _is_any(dismissed, placement) else "clicked" if _is_any(clicks, placement) else "open"
            for placement in self.placements
        )


def _is_any(seen: Sequence[tuple[int, Vector3 | None]], placement: Placement) -> bool:
    """Return whether any of some moments lies in a placement, and its position, if known, at the placement's."""
    return any(
        placement.start <= time <= placement.end
        and (point is None or np.linalg.norm(point - placement.position_radar_m) < _SAME_PLACE_M)
        for time, point in seen
    )


def true_positions(calibration: Calibration, pairs: Sequence[PairResult]) -> Points3:
    """Return where the radar's positions of some pairs (n, 3) truly are: its estimated errors are taken out."""
    return calibration.radar_errors.corrected(np.array([pair.point_radar_m for pair in pairs]).reshape(-1, 3))
