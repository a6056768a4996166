"""The answer first: verdict, transform both ways, error bars, and the figures of the pairs."""

import numpy as np

from calib_core.geometry import RigidTransform, quaternion_wxyz_from_matrix
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.own.raw_data import aed_either_way, other_pose
from calib_core.results import Calibration
from calib_core.results.verdict import verdict_on
from calib_core.words.verdict import stated_verdict
from cocalib.report.markup import Child, Markup, tag
from cocalib.report.plots import drawing, rounded_step, text
from cocalib.report.subject import ReportSubject
from cocalib.view.figures import (
    Mounting,
    assumed_figures,
    metric_figures,
    mounting_of,
    pose_figures,
    uncertainty_sentences,
)
from cocalib.view.wording import plain, sentence

_LEVEL_SIGNS = {
    "good": "●",
    "usable": "◐",
    "coarse": "○",
    "contradictory": "✕",
    "nothing": "–",
    "not judged": "–",
}
"""The level as a shape, for print without color."""
_ROW = 15.0
_GOOD_LIMITS = "10 cm and 1 deg"


def answer(subject: ReportSubject) -> Markup:
    """Return verdict, transforms, error bars and figures."""
    calibration = subject.calibration
    figures = [_error_bars(calibration), _figures(calibration)] if calibration is not None else [_no_camera()]
    return tag(
        "section",
        tag("h2", "Answer"),
        _verdict(subject),
        tag("div", *_transforms(subject), class_="two"),
        tag("div", *figures, class_="two"),
        id="answer",
    )


def _verdict(subject: ReportSubject) -> Markup:
    level, reason, action, assumes = _judgement(subject)
    return tag(
        "div",
        tag(
            "p",
            tag("span", _LEVEL_SIGNS[level], class_="sign", aria_hidden="true"),
            tag("strong", level),
            class_="level",
        ),
        tag(
            "div",
            tag("p", sentence(reason)),
            *([tag("p", tag("b", "Assumes: "), sentence(assumes))] if assumes else []),
            tag("p", tag("b", "Next: "), sentence(action), class_="next"),
        ),
        class_=f"verdict {level.split()[0]}",
    )


def _judgement(subject: ReportSubject) -> tuple[str, str, str, str]:
    """Return level, reason, action and what is assumed: of the file, else judged now, if there is anything to judge by."""
    stated = subject.found.file.verdict if subject.found.file is not None else None
    calibration = subject.calibration
    if stated is None and (calibration is None or not (calibration.pairs or np.isfinite(calibration.covariance).all())):
        return (
            "not judged",
            "the file states no uncertainty and contains no pairs, so nothing in it says how good the pose is",
            "click the reflector in a recording of these sensors with cocalib open RECORDING --calibration FILE, "
            "and report it with that recording",
            "",
        )
    verdict = stated if stated is not None else stated_verdict(verdict_on(calibration))
    reason = f"to {verdict.reason}" if verdict.level in ("good", "usable") else verdict.reason
    return verdict.level, reason, verdict.action, verdict.assumes


def _transforms(subject: ReportSubject) -> tuple[Markup, Markup]:
    camera_from_radar = subject.found.camera_from_radar
    radar, camera = subject.frames.radar, subject.frames.camera
    return (
        _transform("camera_from_radar", "p_camera = R p_radar + t", radar, camera, camera_from_radar),
        _transform("radar_from_camera", "p_radar = R p_camera + t", camera, radar, camera_from_radar.inverse()),
    )


def _transform(name: str, equation: str, source: str, target: str, transform: RigidTransform) -> Markup:
    """Return one direction: matrix rows [R | t], translation and quaternion, each number in full in its value attribute."""
    matrix = np.hstack([transform.rotation, transform.translation_m[:, None]])
    rows = (
        tag("tr", *(tag("td", _data(value, 6 if column < 3 else 4)) for column, value in enumerate(row)))
        for row in matrix.tolist()
    )
    quaternion = quaternion_wxyz_from_matrix(transform.rotation).tolist()
    heads = ("R", "", "", "t [m]")
    return tag(
        "div",
        tag("h3", tag("code", name)),
        tag("p", tag("code", equation), "; from ", tag("code", source), " to ", tag("code", target), class_="note"),
        tag(
            "table",
            tag("thead", tag("tr", *(tag("th", head, scope="col") if head else tag("td") for head in heads))),
            tag("tbody", *rows),
            class_="matrix",
        ),
        tag(
            "p",
            "quaternion wxyz ",
            *(part for value in quaternion for part in (_data(value, 6), " ")),
            class_="quaternion",
        ),
        id=name,
    )


def _data(value: float, decimals: int) -> Markup:
    return tag("data", f"{value + 0.0:.{decimals}f}", value=repr(float(value)))


def _no_camera() -> Markup:
    return tag(
        "p",
        "The file contains no camera, so nothing is said in pixels. Give the intrinsics with --camera FILE, or a recording "
        "that contains them.",
        class_="note",
    )


def _error_bars(calibration: Calibration) -> Markup:
    heading = tag("h3", "Mounting and its error")
    if not np.isfinite(calibration.covariance).all():
        shown = [figure for figure in pose_figures(calibration) if figure.unit in ("cm", "°")]
        return tag(
            "div",
            heading,
            _table(("camera", ""), [(one.label, f"{one.value} {one.unit}") for one in shown]),
            tag("p", "No error bars: this calibration states no covariance.", class_="note"),
        )
    shown = [
        figure for figure in pose_figures(calibration) if figure.unit in ("cm", "°") and figure.key != "radar_angles"
    ]
    keys = [one.key for one in shown]
    rows = [(one.name, f"{one.value} {one.unit}") for one in shown]
    assumed = ", ".join(f"{figure.label} {figure.value} {figure.unit}" for figure in assumed_figures(calibration))
    return tag(
        "div",
        heading,
        _bars(calibration, keys, rows),
        tag(
            "p",
            f"Camera in the radar's axes, ± one standard deviation. Bars: ± two. Ticks: {_GOOD_LIMITS}.",
            class_="note",
        ),
        tag("p", f"Assumed, because this radar measures no elevation: {assumed}.", class_="note") if assumed else None,
        *(tag("p", str(line), class_="note") for line in uncertainty_sentences(calibration)),
    )


def _bars(calibration: Calibration, keys: list[str], rows: list[tuple[str, str]]) -> Markup:
    """Return one bar per parameter; positions and angles have a scale each, on which the limit of a good error is a tick."""
    sigmas = _sigmas(mounting_of(calibration), calibration)
    scales = {
        part: max(rounded_step(2.0 * max((sigmas[key] for key in keys if key in part), default=0.0)), good)
        for part, good in ((_PLACES, 10.0), (_ANGLES, 1.0))
    }
    drawn: list[Child] = []
    for index, (key, (label, value)) in enumerate(zip(keys, rows, strict=True)):
        part, good = (_PLACES, 10.0) if key in _PLACES else (_ANGLES, 1.0)
        y = 10.0 + _ROW * index
        half = 62.0 * min(1.0, 2.0 * sigmas[key] / scales[part])
        tick = 62.0 * good / scales[part]
        drawn += [
            text(0, y + 3.5, label),
            text(176, y + 3.5, value, class_="end"),
            tag("line", x1=250 - 64, x2=250 + 64, y1=y, y2=y, class_="grid"),
            tag("rect", x=250 - half, y=y - 3.5, width=2 * half, height=7.0, class_="bar"),
            *(tag("line", x1=at, x2=at, y1=y - 5, y2=y + 5, class_="axis") for at in (250 - tick, 250 + tick)),
        ]
    words = "Error bars: " + "; ".join(f"{label} {value}" for label, value in rows)
    return drawing(words, *drawn, height=12 + _ROW * len(keys))


_PLACES = ("camera_x", "camera_y", "camera_z")
_ANGLES = ("roll", "pitch", "yaw")


def _sigmas(mounting: Mounting, calibration: Calibration) -> dict[str, float]:
    """Return standard deviations by key, in centimeters and degrees; of a radar without elevation those that pairs determine."""
    from calib_core.results.radar_axes import sigma_in_radar_axes

    places, angles = mounting.position_sigma_m.tolist(), mounting.roll_pitch_yaw_sigma_rad.tolist()
    if not calibration.sees_elevation:
        firm = sigma_in_radar_axes(calibration.camera_from_radar, calibration.firm_covariance)
        places, angles = firm.position_m.tolist(), firm.rotation_rad.tolist()
    in_cm, in_deg = (100.0 * value for value in places), (float(np.rad2deg(value)) for value in angles)
    return {**dict(zip(_PLACES, in_cm, strict=True)), **dict(zip(_ANGLES, in_deg, strict=True))}


def _figures(calibration: Calibration) -> Markup:
    """Return the figures of the pairs as a table; without pairs, that there are none."""
    heading = tag("h3", "Agreement of the pairs")
    if not calibration.pairs:
        return tag(
            "div",
            heading,
            tag("p", "The file contains no pairs: residuals need a recording with clicks.", class_="note"),
        )
    metrics = calibration.metrics
    rows = [(figure.name, f"{figure.value} {figure.unit}".strip()) for figure in metric_figures(calibration)]
    if np.isfinite(metrics.chi2) and metrics.degrees_of_freedom:
        rows.append(("chi2 / degrees of freedom", f"{plain(metrics.chi2)} / {metrics.degrees_of_freedom}"))
    if np.isfinite(metrics.picture_sigma_px):
        rows.append(("in the image (1 sigma, pose)", f"± {plain(metrics.picture_sigma_px, 2)} px"))
    either = aed_either_way(CalibrationFile(calibration))
    if differ := either is not None and plain(either[0]) != plain(either[1]):
        rows.insert(1, ("mean reprojection error (AED) without the corrections", f"{plain(either[1])} px"))
    note = "Corrections: radar biases, which only calibration-1 can hold."
    if other := other_pose(CalibrationFile(calibration)):
        note += f" Files that serve to project returns as reported hold another pose: {other.gain}."
    return tag("div", heading, _table(("figure", "value"), rows), tag("p", note, class_="note") if differ else None)


def _table(heads: tuple[str, str], rows: list[tuple[str, str]]) -> Markup:
    body = (tag("tr", tag("th", label, scope="row"), tag("td", value)) for label, value in rows)
    head = tag("thead", tag("tr", *(tag("th", name, scope="col") if name else tag("td") for name in heads)))
    return tag("table", head, tag("tbody", *body), class_="figures")
