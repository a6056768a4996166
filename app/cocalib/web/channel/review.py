"""What one page reviews: it is computed outside the event loop, and only for the newest request of each kind."""

import asyncio
import base64
import binascii
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

from calib_core.association.pairing import RadarSource
from calib_core.camera import Camera
from calib_core.errors import CalibrationError, InputError
from calib_core.interchange.hypotheses.reading import read_clear
from calib_core.interchange.importing import adopted_calibration
from calib_core.measurements import Unsolvable
from calib_core.options import CalibrationOptions
from calib_core.results import Calibration
from calib_core.words.outcomes import said_of
from calib_core.words.text import words
from cocalib.session.state import Session
from cocalib.solving.solving import solve_clicks
from cocalib.view.contours import contour_maps
from cocalib.view.review import (
    Compared,
    PairReview,
    Solution,
    compared,
    not_compared,
    pair_review,
    previous_calibration,
    review_of,
    solution_of,
)
from cocalib.web.channel.outbox import NewestWins, Outbox
from cocalib.web.messages.incoming import (
    CompareWanted,
    PairReviewWanted,
    ReviewRequest,
    ReviewWanted,
    SolutionKind,
    UncertaintyWanted,
)
from cocalib.web.messages.outgoing import Outgoing, Uncertainty, encode
from cocalib.workspace import Workspace

_Work: TypeAlias = Callable[[], Outgoing]

_LABELS: dict[SolutionKind, str] = {
    "now": "now",
    "default": "default method",
    "paper": "the paper's method",
    "toggled": "with or without the pair",
    "before": "before the last change",
    "reference": "the calibration given at the start",
    "file": "the file",
}


class ReviewService:
    """Answers the reviews of one page. Runs on the event loop; the answers are computed in a thread."""

    def __init__(
        self,
        workspace: Workspace,
        recording: RadarSource,
        camera: Callable[[], Camera | None],
        outbox: Outbox,
        report: Callable[[str], None],
    ) -> None:
        self._workspace = workspace
        self._recording = recording
        self._camera = camera
        self._outbox = outbox
        self._sent: CompareWanted | None = None
        self._read: tuple[CompareWanted, Solution] | None = None
        self._workers = {
            form: NewestWins(partial(self._send, kind), report)
            for form, kind in (
                (ReviewWanted, "review"),
                (PairReviewWanted, "pair_review"),
                (CompareWanted, "compared"),
                (UncertaintyWanted, "uncertainty"),
            )
        }

    def give(self, request: ReviewRequest) -> None:
        """Answer this as soon as the current request of its kind is done; of those that wait, only the newest counts."""
        if isinstance(request, CompareWanted) and request.file_name:
            self._sent = request
        self._workers[type(request)].give(partial(self._answer, request))

    def close(self) -> None:
        """Drop all that waits."""
        for worker in self._workers.values():
            worker.close()

    async def _send(self, kind: str, work: _Work) -> None:
        message = await asyncio.get_running_loop().run_in_executor(None, work)
        self._outbox.put(encode(message), kind=kind)

    def _answer(self, request: ReviewRequest) -> Outgoing:
        session = self._workspace.session
        calibration = session.outcome if isinstance(session.outcome, Calibration) else None
        if isinstance(request, ReviewWanted):
            return review_of(calibration, session.outcome_revision)
        if isinstance(request, PairReviewWanted):
            return (
                pair_review(calibration, request.id)
                if calibration
                else PairReview(request.id, words("Not solved yet."))
            )
        if isinstance(request, UncertaintyWanted):
            return Uncertainty(session.outcome_revision, contour_maps(calibration) if calibration else ())
        return self._compare_solutions(request)

    def _compare_solutions(self, request: CompareWanted) -> Compared:
        session = self._workspace.session
        try:
            return compared(
                session.revision,
                self._solution(request.a, request, session),
                self._solution(request.b, request, session),
            )
        except CalibrationError as error:
            return not_compared(session.revision, _LABELS[request.a], _LABELS[request.b], str(error))

    def _solution(self, kind: SolutionKind, request: CompareWanted, session: Session) -> Solution:
        """Return one of the two solutions, solving for it if it is not there.

        Raises:
            InputError: there is none, and why.
        """
        if kind in ("reference", "file", "before"):
            return self._existing_solution(kind)
        if kind == "now" or kind == session.options.method:
            if not isinstance(session.outcome, Calibration) or session.outcome.checking:
                raise InputError("there is no checked calibration yet; this is compared once there is one")
            return solution_of(_LABELS[kind], session.outcome)
        if kind == "toggled":
            return self._toggled(request.pair, session)
        options = replace(session.options, method="paper" if kind == "paper" else "default")
        return solution_of(_LABELS[kind], self._solved(session, options))

    def _existing_solution(self, kind: SolutionKind) -> Solution:
        """Return a solution that exists already.

        Raises:
            InputError: it does not.
        """
        if kind == "file":
            return self._solution_in_file()
        if kind == "reference":
            reference = self._workspace.reference
            if reference is None:
                raise InputError("no calibration was given at the start; cocalib open --calibration FILE gives one")
            return solution_of(reference.name, reference.calibration)
        before = previous_calibration(self._workspace.history)
        if before is None:
            raise InputError("there is no earlier answer to compare with; it comes with the next change")
        return solution_of(_LABELS[kind], before)

    def _toggled(self, name: str | None, session: Session) -> Solution:
        """Solve without a pair that is used, or with one that is excluded.

        Raises:
            InputError: there is no such pair, or no calibration.
        """
        click = next((click for click in session.clicks if click.id == name), None)
        if click is None:
            raise InputError("no pair is selected; select the one to leave out")
        if click.mark == "untouched" and not click.excluded:
            raise InputError(f"{click.id} is an untouched guess, which has no weight; select another pair")
        others = tuple(replace(one, excluded=not one.excluded) if one is click else one for one in session.clicks)
        label = f"{'with' if click.excluded else 'without'} {click.id}"
        return solution_of(label, self._solved(replace(session, clicks=others), session.options))

    def _solved(self, session: Session, options: CalibrationOptions) -> Calibration:
        outcome = solve_clicks(self._recording, session.clicks, self._camera(), options)
        if isinstance(outcome, Unsolvable):
            raise InputError(str(said_of(outcome)))
        return outcome

    def _solution_in_file(self) -> Solution:
        """Read the calibration file that the page sent last, once.

        Raises:
            InputError: there is none, it is not a calibration, or contradicts itself.
        """
        request = self._sent
        if request is None:
            raise InputError("no calibration file has been given; drop one here, or choose it")
        if self._read is not None and self._read[0] is request:
            return self._read[1]
        name = request.file_name or "the file"
        camera = self._camera()
        if camera is None:
            raise InputError(f"{name}: drawing a calibration needs intrinsics; start again with --camera FILE")
        try:
            data = base64.b64decode(request.file_base64, validate=True)
        except binascii.Error as error:
            raise InputError(f"{name}: was not sent as base64: {error}") from None
        calibration = read_clear(data, name)
        self._read = request, Solution(name, calibration, adopted_calibration(calibration, name, camera=camera))
        return self._read[1]
