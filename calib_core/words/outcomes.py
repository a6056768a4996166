"""What is said where there is no calibration, or where a click has no radar position: a row for each code, as for warnings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from calib_core.json_forms import Name
from calib_core.measurements import DataWarning, Unpaired, Unsolvable
from calib_core.results.actions import CalibrateLens, SetOption
from calib_core.results.verdict import SURE_PAIRS
from calib_core.words import intrinsics, proposing
from calib_core.words.remark import Remark, Row, by_code, by_row, remark
from calib_core.words.text import Words, join, option, say, sentence
from calib_core.words.unpaired import unpaired_remark
from calib_core.words.warnings import warning_remark

_INTRINSICS = (
    "check that clicks and radar data are from the same times, that the intrinsics belong to this camera at this image "
    "size"
)


def too_few_pairs(*, used: int, needed: int, excluded: int, unpaired: int, untouched: int = 0) -> Remark:
    kinds = ((excluded, "excluded"), (unpaired, "unpaired"), (untouched, "untouched"))
    others = "".join(f", {count} {what}" for count, what in kinds if count)
    return remark(
        f"{used} of at least {needed} required pairs{others}",
        "click the reflector at more placements: ten or more, near and far, spread over the image",
    )


def mirrored_axes(*, agreeing: int, pairs: int) -> Remark:
    return remark(
        f"only {agreeing} of {pairs} pairs agree on any pose; with one radar axis mirrored they fit better",
        say(
            "radar axes must be x forward, y left, z up: read them as they are, with {axes}, or flip the sign of y (or of the "
            "elevation) at the source",
            axes=option("radar_axes", "forward,right,up"),
        ),
        SetOption("radar_axes", "forward,right,up"),
    )


def no_pose(*, agreeing: int, pairs: int) -> Remark:
    if agreeing == pairs - 1 and pairs < SURE_PAIRS:
        return remark(
            f"one of the {pairs} pairs does not fit",
            "one more placement will show which",
        )
    return remark(
        f"only {agreeing} of {pairs} pairs agree on any pose",
        f"{_INTRINSICS}, and that the placements are spread over the image",
    )


def degenerate_placements(*, placements: int, clicks: int | None = None, needed: int = 0) -> Remark:
    if clicks is None:
        return remark(
            f"the {placements} placements do not determine the pose: they lie at one place or on one line",
            "spread the placements: near and far, left and right",
        )
    return remark(
        f"the {clicks} clicks show {placements} of at least {needed} required placements: clicks of one placement count as one",
        "move the reflector between clicks: near and far, left and right",
    )


def points_in_one_line(*, pairs: int) -> Remark:
    return remark(
        f"the radar positions of all {pairs} pairs are at one place or on one line",
        "place the reflector left and right, near and far",
    )


def refinement_diverged() -> Remark:
    return remark(
        "Levenberg-Marquardt on all pairs diverged",
        "exclude the pairs with the largest residuals, or use the default method",
        SetOption("method", "default"),
    )


def no_consensus(*, pairs: int, threshold_px: float) -> Remark:
    return remark(
        f"RANSAC finds no pose that brings enough of the {pairs} pairs within {threshold_px:g} px, neither with the iterative "
        "solver nor with SQPnP",
        say(
            "raise {threshold} to about three times the pixel noise (radar angles alone make 10 to 20 px), or use the default "
            "method, which needs no threshold",
            threshold=option("paper.ransac_threshold_px"),
        ),
        SetOption("method", "default"),
    )


def useless_lens_covariance(*, parameter: str = "", value_px: float = 0.0, sigma_px: float = 0.0) -> Remark:
    if not parameter:
        return remark(
            "the intrinsics are to be refined, but the camera's covariance says that they are exact",
            "turn refining off, or remove the covariance, to refine them with the sigmas of the refining options",
            SetOption("refining.intrinsics", "false"),
        )
    return remark(
        f"the camera's covariance says that {parameter}, {value_px:.0f} px, is known to ± {sigma_px:.0f} px, as if the lens had "
        "not been calibrated",
        "check the covariance's order and units (variances in px²), remove it, or calibrate the lens with a board",
        CalibrateLens(),
    )


def stopped() -> Remark:
    return remark("stopped before the end", "start it again")


def unreadable(*, why: str, images: int = 0) -> Remark:
    if images:
        return remark(f"none of {images} images can be read: {why}", "check the files")
    return remark(why, "the clicks are kept; fix the problem, then change any click to try again")


def internal_error(*, fault: str) -> Remark:
    return remark(f"the solver failed: {fault}", "the clicks are kept; change any click to try again")


def no_camera() -> Remark:
    return remark(
        "the camera intrinsics are missing: the recording contains none that can be used",
        "calibrate the lens from a board (Lens in the menu, cocalib intrinsics), drop a camera file on the page, or start again "
        "with --camera FILE",
        CalibrateLens(),
    )


def no_clicks() -> Remark:
    return remark("nothing was clicked", "click the recording on the page, or set auto = true")


OUTCOMES: Mapping[str, Row] = {
    **by_code(
        degenerate_placements,
        internal_error,
        mirrored_axes,
        no_camera,
        no_clicks,
        no_consensus,
        no_pose,
        points_in_one_line,
        refinement_diverged,
        stopped,
        too_few_pairs,
        unreadable,
        useless_lens_covariance,
    ),
    **intrinsics.OUTCOMES,
    **proposing.OUTCOMES,
}


def outcome_remark(outcome: Unsolvable) -> Remark:
    """Return why there is no calibration, and what to do: about what looks wrong with the input, if anything does."""
    own = by_row(outcome, OUTCOMES)
    causes = list(map(warning_remark, outcome.suspected))
    if not causes:
        return own
    return Remark(
        own.message, join((join((cause.message, cause.hint), "; ") for cause in causes), "; "), causes[0].action
    )


def remark_on(stated: DataWarning | Unsolvable | Unpaired) -> Remark:
    """Return what is said of any of them."""
    if isinstance(stated, DataWarning):
        return warning_remark(stated)
    return unpaired_remark(stated) if isinstance(stated, Unpaired) else outcome_remark(stated)


def said_of(stated: DataWarning | Unsolvable | Unpaired) -> Words:
    """Return message and hint in one phrase."""
    said = remark_on(stated)
    return join((said.message, said.hint), "; ")


def in_sentences(stated: DataWarning | Unsolvable | Unpaired) -> Words:
    """Return message and hint, a sentence each."""
    said = remark_on(stated)
    return join((sentence(said.message), sentence(said.hint)))


def by_cause(unpaired: Sequence[Unpaired]) -> Iterator[tuple[tuple[str, ...], Unpaired]]:
    """Yield the ids of the clicks that have no radar position for one cause, and the first of them."""
    for code in dict.fromkeys(click.code for click in unpaired):
        alike = [click for click in unpaired if click.code == code]
        yield tuple(click.id for click in alike), alike[0]


@dataclass(frozen=True, slots=True)
class WarningText:
    """A warning as files hold it.

    Attributes:
        code: identifier for programs, such as "mirrored-axes"; stable.
        message: what is wrong, with figures.
        hint: what to do about it.
    """

    code: str
    message: str
    hint: str

    @property
    def warning(self) -> DataWarning:
        """The warning, as the file says it."""
        return DataWarning.reported(self.code, self.message, self.hint)


def warning_text(warning: DataWarning) -> WarningText:
    """Return a warning for a file: pairs by their ids, options by their names."""
    said = warning_remark(warning)
    return WarningText(warning.code, str(said.message), str(said.hint))


@dataclass(frozen=True, slots=True)
class UnpairedText:
    """A click that found no radar position, as files hold it.

    Attributes:
        id: the click's id.
        code: identifier for programs, such as "no-scan", "no-static-return".
        reason: one sentence for the user.
        hint: what to do about it.
    """

    id: Name
    code: str
    reason: str
    hint: str

    @property
    def unpaired(self) -> Unpaired:
        """The click, as the file says it."""
        return Unpaired.reported(self.id, self.code, self.reason, self.hint)


def unpaired_text(click: Unpaired) -> UnpairedText:
    """Return such a click for a file."""
    said = unpaired_remark(click)
    return UnpairedText(click.id, click.code, str(said.message), str(said.hint))
