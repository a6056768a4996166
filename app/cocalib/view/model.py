"""What a client draws: plain numbers and final text, with nothing left to decide."""

from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import msgspec

from calib_core.measurements import Mark, Stamp
from calib_core.options import CalibrationOptions, Method
from calib_core.results import DataWarning, NextPlacement
from calib_core.results.actions import SetOption
from calib_core.results.verdict import VerdictLevel
from calib_core.words.text import Words, sentence, words
from calib_core.words.warnings import warning_remark
from cocalib.session.state import DismissedPlacement

Level: TypeAlias = Literal["none", "plain", "good", "warning"]


@dataclass(frozen=True, slots=True)
class Figure:
    """One number as displayed.

    Attributes:
        key: for programs, such as "aed"; stable.
        label: for display, such as "mean reprojection error".
        value: formatted, with its standard deviation if that is known: "12.4", "0.31 ± 0.08".
        unit: such as "px"; "" if it has none.
        hint: one sentence that explains the number, shown on hover.
        level: whether it needs attention.
        abbreviation: as the paper has it, such as "AED"; "" if it has none.
    """

    key: str
    label: str
    value: str
    unit: str
    hint: str
    level: Level = "plain"
    abbreviation: str = ""

    @property
    def name(self) -> str:
        """Label and abbreviation: "mean reprojection error (AED)"."""
        return f"{self.label} ({self.abbreviation})" if self.abbreviation else self.label


ClickState: TypeAlias = Literal["pending", "inlier", "outlier", "excluded", "unpaired", "untouched"]
PlacementState: TypeAlias = Literal["open", "marked", "guess", "dismissed", "unlikely"]
"""Wants a click; has one that somebody looked at; has one that nobody has touched; is not the reflector, as the user said, or as
the pose says: the camera does not see it, or sees nothing there that was put down."""
Stage: TypeAlias = Literal["collecting", "solving", "solved", "unsolvable"]


class Ellipse(msgspec.Struct, frozen=True, array_like=True):
    """The region around a reprojection that contains 95 % of the residuals of a good pair; written as an array.

    Attributes:
        semi_major_px: semi-major axis.
        semi_minor_px: semi-minor axis.
        angle_rad: from the image's x axis (right) toward its y axis (down) to the longer axis.
    """

    semi_major_px: float
    semi_minor_px: float
    angle_rad: float


@dataclass(frozen=True, slots=True)
class ClickRow:
    """One click: its mark on the image and its row in the table.

    Attributes:
        id: the click's id.
        image_time: stamp of its frame.
        frame: index of its frame.
        u_px: column of the click.
        v_px: row of the click.
        state: according to the latest outcome; "pending" if that does not cover it; "untouched" is a guess that does not count.
        projected_px: reprojection of its radar position (u, v), rounded to 1 % of the ellipse or finer; None if it has none.
        residual_px: length of projected_px minus the current click, rounded likewise; None without projected_px.
        ellipse: None if the method has no noise model.
        range_m: of its radar position; None without one.
        azimuth_deg: of its radar position, positive to the left.
        elevation_deg: of its radar position, positive upwards.
        returns: how many radar returns the position averages; None if unknown.
        outlier_probability: 0 to 1; None if the method has none.
        note: text for the user; "" when there is nothing to say.
        disagrees: with the other pairs, rather than being set aside by the method or an option.
        mark: how it came to its pixel.
        sigma_px: its own standard deviation per axis; None if it has the options' value.
        chosen: a person said which return belongs to it.
        placement: number of its placement; -1 if it is of none, or that is not known yet.
    """

    id: str
    image_time: Stamp
    frame: int
    u_px: float
    v_px: float
    state: ClickState
    projected_px: tuple[float, float] | None = None
    residual_px: float | None = None
    ellipse: Ellipse | None = None
    range_m: float | None = None
    azimuth_deg: float | None = None
    elevation_deg: float | None = None
    returns: int | None = None
    outlier_probability: float | None = None
    note: str = ""
    disagrees: bool = False
    mark: Mark = "clicked"
    sigma_px: float | None = None
    chosen: bool = False
    placement: int = -1


@dataclass(frozen=True, slots=True)
class SystematicErrorRow:
    """One systematic error, as a row of a table.

    Attributes:
        figure: its value, a dash if the pairs do not determine it; what would reduce it is in the hint; a warning if it makes
            up a third or more of the variance of position or rotation.
        prior: its prior standard deviation, in the same unit.
        position_percent: its part of the variance of the position.
        rotation_percent: the same of the rotation.
    """

    figure: Figure
    prior: str
    position_percent: int
    rotation_percent: int


@dataclass(frozen=True, slots=True)
class SystematicErrorTable:
    """The systematic errors.

    Attributes:
        rows: those that matter, the largest first.
        sentences: what the largest of them mean, and what would reduce them.
    """

    rows: tuple[SystematicErrorRow, ...] = ()
    sentences: tuple[Words, ...] = ()


@dataclass(frozen=True, slots=True)
class Advice:
    """Where to put the reflector next.

    Attributes:
        best: where, and what it gains.
        range_m: how far from the radar.
        words: the same as a sentence; "" if the verdict's action says it.
    """

    best: NextPlacement
    range_m: float
    words: str


_NO_WORDS = Words()


@dataclass(frozen=True, slots=True)
class VerdictRow:
    """How far the calibration can be trusted, in one line, and what to do.

    Attributes:
        level: decides word, color and shape.
        line: behind the word: ": within 0.5 deg, 6 cm (95 %); 7 px at 20 m".
        action: the one thing that helps most, as a sentence.
        assumes: what the stated error rests on and no pair can show, as a sentence; empty if there is nothing.
        word: the level, where the line begins with it; else "".
        kind: of the action, one of `calib_core.results.actions`.
        pairs: that the action is about.
        key: of the page, that does or begins it; "" if there is none.
        option: path of the option that does it; "" if there is none.
        done: nothing more is needed.
        early: nothing is wrong, there are only fewer pairs than the verdict needs; the line counts them.
        misfits: which pairs are set aside because they do not fit the others, as a sentence; empty if there are none.
    """

    level: VerdictLevel
    line: Words
    action: Words
    assumes: Words
    word: str = ""
    kind: str = ""
    pairs: tuple[str, ...] = ()
    key: Literal["", "N", "E"] = ""
    option: str = ""
    done: bool = False
    early: bool = False
    misfits: Words = _NO_WORDS


_UNCLICKED = VerdictRow("nothing", words("No clicks yet"), Words(), Words(), early=True)


@dataclass(frozen=True, slots=True)
class WarningRow:
    """A warning, in sentences.

    Attributes:
        code: stable.
        message: what is wrong.
        hint: what to do about it.
        kind: of the action that does it, one of `calib_core.results.actions`; "" if the page cannot begin it.
        option: path of the option that does it; "" if there is none.
    """

    code: str
    message: Words
    hint: Words
    kind: str = ""
    option: str = ""


def warning_row(warning: DataWarning) -> WarningRow:
    """Return a warning as the page shows it."""
    said = warning_remark(warning)
    kind = type(said.action).__name__ if said.action is not None else ""
    option = said.action.name if isinstance(said.action, SetOption) else ""
    return WarningRow(warning.code, sentence(said.message), sentence(said.hint), kind, option)


@dataclass(frozen=True, slots=True)
class AssumptionRow:
    """An assumption about the recording that waits for the user's confirmation.

    Attributes:
        text: identifies it, also in the page's confirmation.
        words: the same as a sentence.
        hint: what to do if it is right, and if it is not.
    """

    text: str
    words: str
    hint: str


@dataclass(frozen=True, slots=True)
class View:
    """Everything a client draws about the session.

    Attributes:
        revision: of the session; grows with every change.
        stage: how far the session has come.
        status: what the status line says of the calibration under review; "" otherwise.
        solving: this revision is being solved; what is shown belongs to an older one, unless it is being checked.
        checking: what is shown is a preview of this revision's answer; warnings and advice are still the previous ones.
        solved_revision: the revision that the figures belong to; -1 without figures.
        can_undo: whether there is a change to undo.
        can_redo: whether there is a change to redo.
        has_calibration: whether there is a calibration to download.
        method: the one in the options.
        clicks: in order of image time.
        metrics: how well the pairs agree.
        pose: the camera's position and angles relative to the radar, and the uncertainty in the image.
        pose_assumed: the part of the pose that a radar without elevation does not show; empty for others.
        systematic_errors: the systematic errors, and their parts in the uncertainty.
        warnings: of the latest outcome, the gravest first.
        options: the current ones; changes are sent as a part of this tree.
        residual_limit_px: residuals above this should be checked; None without a calibration.
        advice: where to put the reflector next; None without a calibration.
        reference: file name of the calibration under review; "" if there is none.
        comparison: how far the solved calibration is from the reference; empty if either is missing.
        assumptions: what the recording does not state, reading it takes for granted, and nobody has confirmed.
        verdict: how far the calibration can be trusted, and what to do next.
        dismissed: the placements that the user dismissed.
        reviewed: ids of the clicks that the user has looked at and left as they are.
        acknowledged: the codes of the warnings that the user has read.
        placements: what became of each placement that was found in the radar data.
    """

    revision: int
    stage: Stage
    status: str
    solving: bool
    checking: bool
    solved_revision: int
    can_undo: bool
    can_redo: bool
    has_calibration: bool
    method: Method
    clicks: tuple[ClickRow, ...]
    metrics: tuple[Figure, ...]
    pose: tuple[Figure, ...]
    warnings: tuple[WarningRow, ...]
    options: CalibrationOptions
    residual_limit_px: float | None
    advice: Advice | None = None
    reference: str = ""
    comparison: tuple[Figure, ...] = ()
    pose_assumed: tuple[Figure, ...] = ()
    assumptions: tuple[AssumptionRow, ...] = ()
    dismissed: tuple[DismissedPlacement, ...] = ()
    reviewed: tuple[str, ...] = ()
    acknowledged: tuple[str, ...] = ()
    systematic_errors: SystematicErrorTable = field(default_factory=SystematicErrorTable)
    verdict: VerdictRow = _UNCLICKED
    placements: tuple[PlacementState, ...] = ()
