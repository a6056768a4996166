"""What the View says about boxes: the objects that have some, and what they say about the calibration."""

from dataclasses import dataclass

from calib_core.evaluation.figures import Axis
from calib_core.results import DataWarning
from cocalib.view.figure import Figure


@dataclass(frozen=True, slots=True)
class BoxTrackRow:
    """One object with a box: its row in the table.

    Attributes:
        id: of its track.
        label: its class.
        first: index of the first frame with its box.
        last: index of the last one.
        boxes: number of frames with its box.
        keyframes: indices of the frames in which a person stated something about it; empty for boxes from a file.
        hidden: those of them from which on it is hidden.
        note: where and why its box ends; "" when there is nothing to say.
        following: it is being followed through the frames.
    """

    id: str
    label: str
    first: int
    last: int
    boxes: int
    keyframes: tuple[int, ...]
    hidden: tuple[int, ...]
    note: str
    following: bool


@dataclass(frozen=True, slots=True)
class ClassRow:
    """Acc of one class.

    Attributes:
        label: the class, or "without a box".
        acc: formatted, with its unit.
        frames: number of frames with returns of this class.
        returns: number of those returns.
        inside: how many of them are in their box.
    """

    label: str
    acc: str
    frames: int
    returns: int
    inside: int


@dataclass(frozen=True, slots=True)
class SensitivityRow:
    """Acc of the calibration turned about one axis of the camera.

    Attributes:
        axis: turned about.
        angles_deg: ascending.
        acc_percent: at each angle.
        values: at -1, 0 and +1 deg, formatted with their unit.
        words: what Acc sees of this axis, as a sentence.
        is_flat: it sees nothing of it.
    """

    axis: Axis
    angles_deg: tuple[float, ...]
    acc_percent: tuple[float, ...]
    values: tuple[str, ...]
    words: str
    is_flat: bool


@dataclass(frozen=True, slots=True)
class AccPanel:
    """What the boxes of the page say about the calibration on the page.

    Attributes:
        figures: Acc with its standard error, the frames that count, and what chance would give.
        classes: by label.
        sensitivity: one row per axis.
        caution: that Acc is not accuracy; "" without figures.
        rule: which returns count and how they were matched; "" without figures.
        problem: why there are no figures; "" if there are, or nothing was judged so far.
        warnings: what the reader of the figures must know.
        judging: figures are being computed; these belong to earlier boxes or an earlier calibration.
    """

    figures: tuple[Figure, ...] = ()
    classes: tuple[ClassRow, ...] = ()
    sensitivity: tuple[SensitivityRow, ...] = ()
    caution: str = ""
    rule: str = ""
    problem: str = ""
    warnings: tuple[DataWarning, ...] = ()
    judging: bool = False
