"""What a client draws: plain numbers and finished text, nothing left to decide."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

from calib_core.measurements import Stamp
from calib_core.options import CalibrationOptions, Method
from calib_core.results import DataWarning

__all__ = ["Advice", "ClickRow", "ClickState", "Ellipse", "Figure", "Level", "Stage", "View"]

ClickState: TypeAlias = Literal["pending", "inlier", "outlier", "excluded", "unpaired"]
Level: TypeAlias = Literal["plain", "good", "warning"]
Stage: TypeAlias = Literal["collecting", "solving", "solved", "unsolvable"]


@dataclass(frozen=True, slots=True)
class Ellipse:
    """Where 95 % of the residuals of a good pair would lie, around its reprojection.

    Attributes:
        semi_major_px: the longer half axis.
        semi_minor_px: the shorter one.
        angle_rad: from the image's x axis (right) towards its y axis (down) to the longer axis.
    """

    semi_major_px: float
    semi_minor_px: float
    angle_rad: float


@dataclass(frozen=True, slots=True)
class ClickRow:
    """One click, its mark on the picture and its line in the table.

    Attributes:
        id: the click's id.
        image_time: stamp of its frame.
        frame: index of its frame.
        u_px: column of the click.
        v_px: row of the click.
        state: what the newest answer says about it; "pending" when it says nothing.
        projected_px: where its radar position comes out on the frame (u, v); None where it does not.
        residual_px: length of projected_px minus the click of now; None without projected_px.
        ellipse: None where the method has no noise model.
        range_m: of its radar position; None without one.
        azimuth_deg: of its radar position, positive to the left.
        elevation_deg: of its radar position, positive upwards.
        returns: how many radar returns the position averages; None where it is not known.
        outlier_probability: 0 to 1; None where the method has none.
        note: one sentence for people; "" when there is nothing to say.
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


@dataclass(frozen=True, slots=True)
class Figure:
    """One number as it is shown.

    Attributes:
        key: for programs, such as "aed"; stable.
        label: for people, such as "AED".
        value: formatted, with its standard deviation where that is known: "12.4", "0.31 ± 0.08".
        unit: such as "px"; "" where it has none.
        hint: one sentence that explains the number, shown on hover.
        level: whether it is fine or needs a look.
    """

    key: str
    label: str
    value: str
    unit: str
    hint: str
    level: Level = "plain"


@dataclass(frozen=True, slots=True)
class Advice:
    """Where to put the reflector next.

    Attributes:
        u_px: column where it would appear.
        v_px: row.
        range_m: how far from the radar.
        gain: present uncertainty over the one expected afterwards, at least 1.
        may_stop: no place is worth the walk.
        position_radar_m: the place.
        words: the same as one or two sentences.
    """

    u_px: float
    v_px: float
    range_m: float
    gain: float
    may_stop: bool
    position_radar_m: tuple[float, ...]
    words: str


@dataclass(frozen=True, slots=True)
class View:
    """Everything a client draws about the session.

    Attributes:
        revision: of the session; grows with every change.
        stage: where the work stands.
        status: the same in a few words: "4 more placements needed", "solving…", "solved: 18 of 20 pairs agree".
        hint: the next thing to do; "" when there is none.
        solving: an answer to this revision is being worked out; what is shown answers an older one.
        solved_revision: the revision that the figures answer; -1 without figures.
        can_undo: whether there is a change to take back.
        can_redo: whether there is one to make again.
        has_calibration: whether there is a calibration to download.
        method: the one in the options.
        clicks: in order of image time.
        metrics: how well the pairs agree.
        pose: where the camera sits and looks, seen from the radar.
        warnings: the newest answer's.
        options: as they are now; changes are sent as a part of this tree.
        residual_limit_px: residuals beyond this deserve a look; None without a calibration.
        advice: where to put the reflector next; None without a calibration.
        reference: file name of the calibration that was given to look at; "" without one.
        comparison: how far the solved calibration lies from it; empty without either.
    """

    revision: int
    stage: Stage
    status: str
    hint: str
    solving: bool
    solved_revision: int
    can_undo: bool
    can_redo: bool
    has_calibration: bool
    method: Method
    clicks: tuple[ClickRow, ...]
    metrics: tuple[Figure, ...]
    pose: tuple[Figure, ...]
    warnings: tuple[DataWarning, ...]
    options: CalibrationOptions
    residual_limit_px: float | None
    advice: Advice | None = None
    reference: str = ""
    comparison: tuple[Figure, ...] = ()
