"""The radar returns that may belong to the selected click, for the page: rings, rows, and points in the 3D view."""

from calib_core.association.pairing import RadarSource
from calib_core.errors import CalibrationError
from calib_core.measurements import Candidate, ReflectorClick
from calib_core.results import Calibration
from cocalib.session import Session
from cocalib.solving.solving import window_candidates
from cocalib.view import PairCandidates, click_candidates, pair_of_click


def candidates_of(session: Session, selected: str | None, recording: RadarSource) -> PairCandidates:
    """List the returns that may belong to the selected click; none if there is no such click, or it has no pair.

    Args:
        session: with the latest outcome.
        selected: id of the click; None if none is selected.
        recording: where further returns of its window come from, if no candidate of its pair fits.
    """
    click = next((click for click in session.clicks if click.id == selected), None)
    pair = None if click is None else pair_of_click(session, click.id)
    if click is None or pair is None:
        return PairCandidates(selected or "", session.revision, ())
    return click_candidates(session, pair, _further(session, click, recording))


def _further(session: Session, click: ReflectorClick, recording: RadarSource) -> tuple[Candidate, ...]:
    """Return more returns of the window for a click that does not agree with the others."""
    if not isinstance(session.outcome, Calibration):
        return ()
    result = next(one for one in session.outcome.pairs if one.id == click.id)
    if result.inlier or not result.outlier_probability > 0.0:
        return ()
    try:
        return window_candidates(recording, click, session.options)
    except CalibrationError:
        return ()
