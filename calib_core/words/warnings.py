"""What the warnings of a calibration say: a row for each code, from its facts to a message, a hint and an action.

The parameters of a row are the facts that its code has, as the check that finds it states them; a test compares the two. A new
warning is one more row; what to do about a warning is decided here and nowhere else.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from calib_core.measurements import DataWarning
from calib_core.results.actions import (
    CalibrateLens,
    ChooseReturn,
    MeasureCameraPosition,
    ReviewPairs,
    SetOption,
    SpreadPlacements,
)
from calib_core.results.systematic_errors import SystematicErrorResult, family_of
from calib_core.words import evaluation, intrinsics
from calib_core.words.remark import Remark, Row, by_code, by_row, remark
from calib_core.words.systematic_errors import FAMILIES, error_words, knowledge, percent, prior_text, value_text
from calib_core.words.text import count, join, listed, named, option, say

_APEX = "the inner corner, where the three plates meet, not the reflector's mouth or stand"
_ONE_BY_ONE = "was the reflector clicked, was it at rest, do both recordings use the same clock?"
_BY_TAPE = "measure the camera position with a tape"


def no_consensus(*, agreeing: int, pairs: int) -> Remark:
    """Given when fewer than 8 pairs agree, and they are at most half of 8 or more.

    Could also be: a wrong pose on which pairs agree by chance, and a right one among many wrong clicks.
    """
    return remark(
        f"only {agreeing} of {pairs} pairs agree on this pose, which can be chance",
        f"check the clicks one by one: {_ONE_BY_ONE}",
    )


def few_pairs(*, agreeing: int, pairs: int, needed: int, clear: bool) -> Remark:
    """Given when fewer than 8 pairs determine the pose; it replaces the warnings that only more pairs can settle."""
    misfits = pairs - agreeing
    seen = f"{agreeing} of {needed} pairs; {misfits} {'does' if misfits == 1 else 'do'} not fit"
    if agreeing == pairs:
        seen = f"{agreeing} of {needed} pairs, {'looks consistent' if clear else 'not clear yet'}"
    return remark(seen, "add placements: ten or more, near and far, on both sides")


def algorithm_1_contradicted(
    *, chi2_per_degree: float, agreeing: int, inliers: int, pairs: int, threshold_px: float
) -> Remark:
    """Given when Algorithm 1 only: its residuals are far larger than the assumed noise.

    Could also be: a radar, or clicks, several times noisier than assumed.
    """
    return remark(
        f"the residuals of Algorithm 1 are {np.sqrt(chi2_per_degree):.1f} times what the assumed noise explains: {agreeing} of "
        f"{pairs} pairs agree with its pose, {inliers} within the {threshold_px:g} px of RANSAC",
        "use the default method, which leaves wrong pairs out; or choose the returns of the pairs with the largest residuals",
        SetOption("method", "default"),
    )


def many_outliers(*, pairs: int, ids: Sequence[str] = ()) -> Remark:
    """Given when more than 35 % of the pairs do not fit."""
    return remark(
        say("{outliers} of {pairs} pairs do not fit: {ids}", outliers=len(ids), pairs=pairs, ids=listed(ids)),
        f"check each of them: {_ONE_BY_ONE}",
        ReviewPairs(tuple(ids)),
    )


def residuals_too_large(*, chi2_per_degree: float) -> Remark:
    """Given when residuals are far larger than the assumed noise.

    Could also be: the cause.
    """
    return remark(
        f"residuals are {np.sqrt(chi2_per_degree):.1f} times what the assumed noise explains "
        f"(chi2 / degrees of freedom {chi2_per_degree:.1f})",
        "check that the intrinsics belong to this camera, lens and image size, that every click is on the reflector's inner "
        "corner, and the assumed radar noise",
    )


def smooth_angle_errors(*, growth: float, uncertain_lens: bool) -> Remark:
    """Given when neighboring placements have similar residuals.

    Could also be: a radar's calibration error from wrong lens parameters: both change slowly with direction.
    `radar_angle_map` in the calibration corrects either (formats.md).
    """
    lens = "a lens as uncertain as its covariance says can look the same: first refine the intrinsics with the pose; "
    return remark(
        "neighboring placements have similar residuals: the radar's angles are off by an amount that changes slowly with "
        f"direction; this makes the stated rotation uncertainty {growth:.1f} times larger",
        f"{lens if uncertain_lens else ''}more placements will not average this out: correct the radar's angles by "
        "radar_angle_map of the calibration, or calibrate the radar; the stated uncertainty includes the error",
    )


def weak_geometry(
    *,
    rotation_deg: float,
    position_cm: float,
    nearest_m: float = 0.0,
    farthest_m: float = 0.0,
    azimuth_span_deg: float = 0.0,
    measured: bool = False,
    paper: bool = False,
) -> Remark:
    """Given when stated uncertainty above 2.5 deg in rotation or 30 cm in position, or a badly conditioned set of
    placements; for Algorithm 1, which states none, above 0.35 deg or 9 cm by its residuals and the placements, so that an
    error of 1 deg or 25 cm is not silent.
    """
    size = f"{rotation_deg:.1f} deg and {position_cm:.0f} cm (one sigma)"
    if paper:
        return remark(
            f"Algorithm 1 states no uncertainty; by its residuals and the placements it is about {size}",
            "use the default method, which weights the pairs by their noise; add placements near and far, at both edges of the "
            "image",
            SetOption("method", "default"),
        )
    message = (
        f"the geometry is ill-conditioned: {size}; placements span {nearest_m:.1f} to {farthest_m:.1f} m and "
        f"{azimuth_span_deg:.0f} deg"
    )
    spread = "place the reflector near (2 to 3 m) and far, at both edges of the image"
    if measured:
        return remark(message, spread, SpreadPlacements("edges"))
    return remark(message, f"{_BY_TAPE}, which helps most; also {spread}", MeasureCameraPosition())


def repeated_placements(*, pairs: int, places: int) -> Remark:
    """Given when fewer than 70 % of the pairs are at distinct places."""
    return remark(
        f"{pairs} pairs cover only {places} places; a radar repeats its error at the same place, so the stated uncertainty is "
        "too small",
        "move the reflector between clicks; more clicks of one placement add little",
    )


def flat_radar(
    *,
    forward_cm: float,
    left_cm: float,
    yaw_deg: float,
    image_px: float,
    up_cm: float,
    pitch_deg: float,
    roll_deg: float,
) -> Remark:
    """Given when every radar position has the same elevation, or the same height.

    Could also be: see below.
    """
    return remark(
        f"this radar measures no elevation. One sigma: the pairs determine forward ± {forward_cm:.0f} cm, left ± {left_cm:.0f} "
        f"cm and yaw ± {yaw_deg:.1f} deg in the plane of the placements, and where its returns appear in the image, "
        f"± {image_px:.0f} px; up ± {up_cm:.0f} cm, pitch ± {pitch_deg:.1f} and roll ± {roll_deg:.1f} deg are assumptions about "
        "how it is mounted",
        "state among the options how well the radar's tilt and height are known, or measure the camera position; if the radar "
        "does measure elevation, find out why it is missing",
    )


def uncertain_association(*, ids: Sequence[str]) -> Remark:
    """Given when another return fits a click as well, with odds of at least 1 to 7, the other clicks of its scene giving
    way.

    Could also be: which of the two it is; where few clicks have such a return, each counts half and does not agree until
    you choose (C).
    """
    return remark(
        say("more than one radar position fits the click of {ids}", ids=listed(ids)),
        "choose the return of each on the page (C), or exclude the pair",
        ChooseReturn(tuple(ids)),
    )


def one_pair_decides(*, pair: str, loss: float) -> Remark:
    """Given when without one pair, some direction of the pose is 8 times less certain.

    Could also be: whether that click is right: no other pair checks it.
    """
    name = named(pair)
    return remark(
        say(
            "part of the pose depends on {name} alone: without it, that part would be {loss:.0f} times less certain, so the "
            "other pairs cannot check its click",
            name=name,
            loss=loss,
        ),
        say("check the click of {name} again, and add a placement near it", name=name),
        ReviewPairs((pair,)),
    )


def excluded_by_residual(*, ids: Sequence[str], aed_px: float, all_aed_px: float) -> Remark:
    """Given when pairs are excluded that would agree, and their residuals are longer than those of a random choice in 98 %.

    Could also be: clicks that were wrong, by less than the noise explains.
    """
    return remark(
        f"{len(ids)} pairs that would agree are excluded, with residuals longer than chance makes them: the mean reprojection "
        f"error is {aed_px:.3g} px without and {all_aed_px:.3g} px with them, and the latter says how well the pose fits",
        say("include those of {ids} again whose click and return are right", ids=listed(ids)),
        ReviewPairs(tuple(ids)),
    )


def mirrored_axes(*, log_likelihood_ratio: float = 0.0, camera_m: float = 0.0, radar_m: float = 0.0) -> Remark:
    """Given when the pose puts radar and camera on different sides of the plane of the placements; or, where that does not
    apply, pairs and expected camera position are 200 times more likely with one radar axis mirrored.

    Could also be: see below.
    """
    flip = say(
        "read the radar's axes as they are: {axes}, or flip the sign of y (or of the elevation) at the source; rows of the "
        "image counted from below look the same; do not use this pose",
        axes=option("radar_axes", "forward,right,up"),
    )
    action = SetOption("radar_axes", "forward,right,up")
    if not camera_m:
        return remark(
            "pairs and expected camera position agree better with one radar axis mirrored (log-likelihood ratio "
            f"{log_likelihood_ratio:.1f}): the radar's axes look left-handed",
            flip,
            action,
        )
    return remark(
        f"the pose puts the camera {_height(camera_m)} the plane of the placements and the radar {_height(radar_m)} it; with one "
        "radar axis mirrored, both are on one side: the radar's axes look left-handed",
        flip
        + say(
            "; if the sensors really are on different sides of the placements, turn {above} off",
            above=option("solving.sensors_above_placements"),
        ),
        action,
    )


def _height(height_m: float) -> str:
    return f"{abs(height_m):.1f} m {'above' if height_m > 0.0 else 'below'}"


def handedness_open() -> Remark:
    """Given when the sides are not clear, and mirrored axes explain the pairs nearly as well, or better.

    Could also be: which of the two is right: measure the camera position, or vary the heights.
    """
    return remark(
        "reflection ambiguity: a mirrored radar axis explains the pairs about as well, or puts radar and camera on one side of "
        "the placements",
        say(
            "{tape}, or add placements at other heights (a tripod); if the radar is lower than the reflector, turn {above} off",
            tape=_BY_TAPE,
            above=option("solving.sensors_above_placements"),
        ),
        MeasureCameraPosition(),
    )


def handedness_assumed(*, within_m: float) -> Remark:
    """Given when no camera position is given, the sides are not clear, and the placements deviate from a plane by no more
    than the radar's noise explains.

    Could also be: whether an axis is mirrored, if the camera were farther away than assumed.
    """
    return remark(
        "reflection ambiguity: the placements lie near one plane, so mirrored radar axes fit equally well; that none is mirrored "
        f"is inferred only from the camera being within about {within_m:g} m of the radar",
        "measure the camera position (0.3 m is enough for this), or add placements at other heights (a tripod)",
        MeasureCameraPosition(),
    )


def clock_bias_suspected(*, ids: Sequence[str], clicks: int, offset_s: float) -> Remark:
    """Given when at least three clicks, and a quarter of all, are outside their dwells, all to the same side.

    Could also be: see below.
    """
    late = offset_s > 0
    seen, relation, when = (
        ("after", "ahead of", "has been at rest for a while")
        if late
        else ("before", "behind", "has just been put down")
    )
    return remark(
        say(
            f"for {{outside}} of {{clicks}} clicks ({{ids}}) the radar sees the reflector only {seen} the click: its stamps seem "
            f"to be {{offset_s:.1f}} s or more {relation} the camera's",
            outside=len(ids),
            clicks=clicks,
            ids=listed(ids),
            offset_s=abs(offset_s),
        ),
        f"compare both clocks (cocalib info), or click when the reflector {when}; if the clocks agree, click in the middle of "
        "each dwell",
    )


def clocks_apart(
    *,
    shifted_agreeing: int,
    shifted_clicks: int,
    placements: int,
    agreeing: int,
    clicks: int,
    apart_s: float,
    scales: str = "",
) -> Remark:
    """Given when two more clicks agree with what the radar saw some placements, or 18 or 35 to 37 s, later or earlier than with
    what it saw at their time; or all do that have such a placement, and no fewer.

    Could also be: see below.
    """
    away = "one placement" if abs(placements) == 1 else f"{abs(placements)} placements"
    later, ahead = ("later", "ahead of") if placements > 0 else ("earlier", "behind")
    agree = (
        f"{shifted_agreeing} of {shifted_clicks} clicks agree with what the radar saw {away} {later}, {agreeing} of {clicks} "
        "with what it saw at their time: "
    )
    if abs(apart_s) < 0.5:  # the times of a file that only tell the order
        return remark(
            agree + "the radar positions seem to be in the wrong rows",
            f"write each click beside the radar position of its own placement, {away} {later} in the file",
        )
    return remark(
        f"{agree}its stamps seem to be about {abs(apart_s):.0f} s {ahead} the camera's"
        + (f", as {scales} are" if scales else ""),
        say(
            "compare both clocks (cocalib info); if one computer recorded both sensors, use the times of receipt: {receive}; "
            "else say by how many seconds the radar's stamps are late: {late}",
            receive=option("clock", "receive"),
            late=option("radar_late", f"{apart_s:.0f}"),
        ),
        SetOption("radar_late", f"{apart_s:.0f}") if scales else SetOption("clock", "receive"),
    )


def two_poses(
    *,
    away_deg: float,
    away_cm: float,
    sigmas: float = 0.0,
    other_returns: Sequence[str] = (),
    probability: float = 0.0,
    agreeing: Sequence[str] = (),
    pairs: int = 0,
) -> Remark:
    """Given when another pose, 6 standard deviations away in rotation or position, is nearly as likely; or would be if all
    radar positions of a pair were equally plausible.

    Could also be: which of the two is right.
    """
    nearer = f"{_BY_TAPE}, or add placements nearer and farther than the present ones"
    if agreeing:
        return remark(
            say(
                "pose ambiguity: another pose, {away}, explains the pairs as well; {count} of {pairs} agree on it: {ids}",
                away=_away_text(away_deg, away_cm),
                count=len(agreeing),
                pairs=pairs,
                ids=listed(agreeing),
            ),
            "check which group shows the reflector, and exclude the other",
            ReviewPairs(tuple(agreeing)),
        )
    if probability:
        return remark(
            f"pose ambiguity: another pose, {_away_text(away_deg, away_cm)}, may be the right one (probability "
            f"{100 * probability:.0f} %); it is not clear which of the pairs are wrong",
            nearer,
            MeasureCameraPosition(),
        )
    two = f"two poses fit, {away_deg:.1f} deg and {away_cm / 100:.2f} m apart ({sigmas:.0f} σ)"
    if not other_returns:
        return remark(two, nearer, MeasureCameraPosition())
    return remark(
        say(
            "{two}; they differ in {ids}{more}",
            two=two,
            ids=join(map(named, other_returns[:3]), ", "),
            more=" and others" if other_returns[3:] else "",
        ),
        say("check {pair}: which return is the reflector? Or {tape}", pair=named(other_returns[0]), tape=_BY_TAPE),
        ChooseReturn(tuple(other_returns)),
    )


def _away_text(away_deg: float, away_cm: float) -> str:
    return f"{away_deg:.1f} deg and {away_cm:.0f} cm away"


def camera_far_away(
    *,
    expected_m: float,
    solved_m: float = 0.0,
    away_deg: float = 0.0,
    away_cm: float = 0.0,
    sigmas: float = 0.0,
    here_m: float = 0.0,
    there_m: float = 0.0,
) -> Remark:
    """Given when the pairs alone leave two poses open, and only the expected distance of the camera selects one; Algorithm
    1: the camera is at three times that distance.

    Could also be: which of the two is right.
    """
    distance = option("solving.nominal_camera_distance_m")
    if solved_m:
        return remark(
            f"the solved camera position is {solved_m:.1f} m from the expected one (± {expected_m:.1g} m)",
            say(
                "if the sensors really are that far apart, set {distance}; otherwise do not use this pose",
                distance=distance,
            ),
            SetOption("solving.nominal_camera_distance_m"),
        )
    return remark(
        f"another pose, {away_deg:.1f} deg and {away_cm / 100:.2f} m away ({sigmas:.0f} σ), explains the pairs as well; the one "
        f"with the camera {here_m:.1f} m from the radar, not {there_m:.1f} m, was chosen only because about {expected_m:g} m is "
        "expected",
        say(
            "are both sensors on the same rig, or how far apart? Set {distance}, or measure the camera position",
            distance=distance,
        ),
        MeasureCameraPosition(),
    )


def agreeing_outliers(*, ids: Sequence[str], in_time: str) -> Remark:
    """Given when four or more pairs that were set aside agree among themselves on another pose, by a likelihood ratio of
    100 or more; if that pose explains all pairs as well, it is `two-poses`.

    Could also be: something always stands near the reflector, such as a cart, or there are two reflectors: check which
    group is right, and exclude the other. If they are the first or last in time, a sensor may have turned.
    """
    turned = f"; they are the {in_time} in time, so the camera or the radar seems to have turned: solve them apart"
    return remark(
        say(
            "{count} pairs are off in the same way and were set aside: {ids}{turned}",
            count=len(ids),
            ids=listed(ids),
            turned=turned if in_time else "",
        ),
        say(
            "look at the returns of {pair}: a cart beside the reflector, a second reflector, or elevations that jump give such "
            "a group",
            pair=named(ids[0]),
        ),
        ReviewPairs(tuple(ids)),
    )


def camera_position_contradicted(
    *, away_cm: float, sigmas: float, misread: str = "", unit: str = "", weight: float = 0.0
) -> Remark:
    """Given when the pairs alone put the camera farther from the measured position than one of 1,000 right sets does.

    Could also be: whether the measured position, the intrinsics or the radar is wrong, or all clicks lie beside the radar's
    phase center.
    """
    return _measured_position(_far_from_measured(away_cm, sigmas, misread, unit), weight)


def camera_position_doubtful(
    *, away_cm: float, sigmas: float, one_in: int, misread: str = "", unit: str = "", weight: float = 1.0
) -> Remark:
    """Given when one of 50 right sets, but not one of 1,000, puts the camera as far from the measured position.

    Could also be: a position that is right, by chance.
    """
    far = _far_from_measured(away_cm, sigmas, misread, unit)
    return _measured_position(f"{far}; one of {one_in:,} right positions looks like this", weight)


def _far_from_measured(away_cm: float, sigmas: float, misread: str, unit: str) -> str:
    looks = {"position": "; the measured position looks like ", "ranges": "; the radar's ranges look like "}
    return (
        f"the pairs alone place the camera {away_cm:.0f} cm from the measured position, {sigmas:.1f} standard deviations"
        f"{looks.get(misread, '')}{'one measured level, not along the tilted radar' if unit == 'level' else unit}"
    )


def _measured_position(message: str, weight: float) -> Remark:
    use = "the pose follows the pairs" if weight < 0.5 else f"the pose still uses it, as {weight:.0%} sure"
    return remark(
        f"{message}; clicks that all lie as far beside the radar's phase center would look the same; {use}",
        f"measure again from the radar's antennas to the lens: forward, left, up; click {_APEX}; and check that the intrinsics "
        "are of this lens, zoom and image size",
        MeasureCameraPosition(),
    )


def intrinsics_suspected(
    *,
    focal_length: float | None = None,
    distortion_px: float = 0.0,
    sigma: float = 0.0,
    beside: Sequence[tuple[str, str]] = (),
    refined_too_far: Sequence[SystematicErrorResult] = (),
    principal_point_px: Sequence[float] = (),
    width_px: int = 0,
    height_px: int = 0,
    mode: str = "",
) -> Remark:
    """Given when a different focal length or distortion explains the residuals best, beyond what is assumed of it. Refined
    intrinsics: one changed by more than three times its stated sigma. Or when the principal point is farther from the image's
    middle than 12 % of its width or height, or in the middle of an image with another aspect ratio.

    Could also be: see below.
    """
    if principal_point_px:
        return _off_middle(principal_point_px, width_px, height_px, mode)
    if refined_too_far:
        changed = "; ".join(f"{error_words(error.name).label} {knowledge(error)}" for error in refined_too_far)
        return remark(
            f"refining changed the intrinsics by more than three times what was stated of them: {changed}; the refined camera "
            "is not to be relied on",
            "check that the intrinsics belong to this camera, lens, zoom and image size, also the signs of the distortion, and "
            "calibrate the lens with a board; only if they are that rough, give refining a larger sigma",
            CalibrateLens(),
        )
    if focal_length is not None:
        message = (
            "residuals grow with the distance from the image's center: the given focal length seems "
            f"{100 * abs(focal_length):.1f} ± {100 * sigma:.1f} % too {'short' if focal_length > 0 else 'long'}"
        )
    else:
        message = (
            "residuals grow with the cube of the distance from the image's center: the given lens distortion seems off by "
            f"{distortion_px:.0f} ± {sigma:.0f} px at the outermost click"
        )
    return remark(
        message,
        "check that the intrinsics belong to this camera, lens, zoom and image size, or calibrate the camera again"
        + (_or_else(beside) or "; a radar with an azimuth scale error of the same size looks the same"),
        CalibrateLens(),
    )


_OF_CAUSES = {
    "range": ("ranges", 100.0, "cm"),
    "azimuth": ("azimuths", 180.0 / np.pi, "deg"),
    "elevation": ("elevations", 180.0 / np.pi, "deg"),
    "column": ("clicks along the columns", 1.0, "px"),
    "row": ("clicks along the rows", 1.0, "px"),
}
"""What a quantity is called, and its unit with the factor from SI."""
_OF_SHAPES = {
    "": "by a constant",
    "range": "more and more with the range",
    "nearness": "more at near placements",
    "azimuth": "more and more with the azimuth",
    "elevation": "more and more with the elevation",
    "azimuth^2": "at both edges",
    "azimuth elevation": "more and more toward opposite corners",
    "elevation^2": "at high and low placements",
    "azimuth^3": "more and more toward the edges",
    "time": "more and more in the course of the recording",
}
_OF_STEPS = {
    "turn": ("the camera or the radar seems to have turned by about", 180.0 / np.pi, "deg"),
    "move": ("the camera or the radar seems to have moved by about", 100.0, "cm"),
    "range step": ("the radar's ranges seem to have jumped by about", 100.0, "cm"),
}


def shared_error_suspected(
    *,
    error: str = "",
    value: float = 0.0,
    sigma: float = 0.0,
    prior_sigma: float = 0.0,
    quantity: str = "",
    shape: str = "",
    largest: float = 0.0,
    largest_sigma: float = 0.0,
    beside: Sequence[tuple[str, str]] = (),
    step: str = "",
    size: float = 0.0,
    before: str = "",
    after: str = "",
    by_number: bool = False,
) -> Remark:
    """Given when an error that all pairs share would explain the residuals, and is beyond what is assumed of it: of the radar's
    ranges, azimuths or elevations, or of all clicks, constant or changing with range, angle or time; or a turn, a move or a
    jump of the ranges between two placements. In fewer than 1 % of sound sets, `intrinsics-suspected` included.

    Could also be: returns of something behind the reflector at every placement, a wrong zoom, a cropped image,
    reflections from floor or walls, other points clicked at near placements, or a radar that is worse than its prior says.
    A turn: smooth angle errors, where the placements walked across the view.
    """
    if step:
        what, factor, unit = _OF_STEPS[step]
        ends = {"before": named(before), "after": named(after)}
        return remark(
            say(
                "{order}{what} {size:.1f} {unit} near {before} and {after}: the placements up to there agree on another pose "
                "than the later ones",
                order="if the pairs are numbered in order of time, " if by_number else "",
                what=what,
                size=factor * size,
                unit=unit,
                **ends,
            ),
            say("solve the placements up to {before} and from {after} on apart, and check both mounts", **ends),
            ReviewPairs((before, after)),
        )
    others = _or_else(beside)
    if quantity:
        what, factor, unit = _OF_CAUSES[quantity]
        owner = "the radar's " if quantity in ("range", "azimuth", "elevation") else "all "
        return remark(
            f"{owner}{what} seem off {_OF_SHAPES[shape]}, by up to {factor * largest:+.1f} ± {factor * largest_sigma:.1f} {unit}"
            f"{others}",
            "check how the radar's driver computes its angles and ranges, whether the floor or a wall reflects the radar there, "
            "and what was clicked at near and at far placements",
        )
    known = error_words(error)
    family = FAMILIES.get(family_of(error))
    name = known.text if family is None else f"{family.text} ({known.label})"
    return remark(
        f"{name}: {value_text(error, value, sigma)} by the pairs, where {prior_text(error, prior_sigma)} is assumed{others}",
        "check that each pair has the reflector's return, not one of what stands behind it, and that the intrinsics are of this "
        "very image, uncropped; if the error is really so large, give it a larger sigma among the options",
    )


def _or_else(beside: Sequence[tuple[str, str]]) -> str:
    """Name the causes that would look nearly the same."""
    if not beside:
        return ""
    names = [
        f"{_OF_CAUSES[quantity][0]} off {_OF_SHAPES[shape]}" if quantity in _OF_CAUSES else f"a wrong {quantity}"
        for quantity, shape in beside
    ]
    return f"; {' or '.join(names)} would look nearly the same"


def angle_scale(*, error: str, value: float, sigma: float, flat: bool, measured: bool) -> Remark:
    """Given when the radar's azimuths or elevations look scaled by more than 1.5 % and three standard deviations.

    Could also be: azimuths: a focal length that is off by the same amount. Elevations, on flat ground: clicks above or
    below the phase center. Both, with a measured camera position: that position.
    """
    tape = "; so would a camera that is not where it was measured" if measured else ""
    size = percent(abs(value), sigma)
    if error == "azimuth_scale":
        large, long = ("large", "long") if value > 0.0 else ("small", "short")
        tilted = "; so would a tilt of the radar" if flat and value > 0.0 else ""
        return remark(
            f"the radar's azimuths look {size} too {large}; a given focal length that is too {long} by the same amount would "
            f"look the same, and pairs cannot tell them apart{tilted}{tape}",
            "check the element spacing and wavelength that the radar's driver assumes, and whether the intrinsics belong to this "
            "camera, lens, zoom and image size; whichever is known to be right, give it a smaller sigma among the options",
        )
    large, side = ("large", "above") if value > 0.0 else ("small", "below")
    return remark(
        f"the radar's elevations look {size} too {large}; on flat ground, clicks {side} the radar's phase center would look the "
        f"same{tape}",
        f"click {_APEX}; to tell the two apart, put a few placements at other heights (a tripod)",
        SpreadPlacements("heights"),
    )


def lens_or_radar_scale(*, change: float, sigma: float, scales: Sequence[SystematicErrorResult]) -> Remark:
    """Given when the intrinsics were refined, the focal length is known to no better than 0.2 %, and more than half of its
    variance would go if the radar's angle scale were known.

    Could also be: a longer focal length and smaller angles of the radar: pairs show their sum. Measure the radar's scale,
    or calibrate the lens on a board.
    """
    changed = ", ".join(
        f"{error_words(scale.name).text} {percent(scale.value, scale.sigma, sign=True)}" for scale in scales
    )
    return remark(
        "lens or radar scale, the data cannot tell: the focal length was changed by "
        f"{percent(change, sigma, sign=True)}, with {changed}; pairs show the sum of both, and only what was assumed before "
        "divides it",
        "measure the radar's angle scale (turn it by known angles) and state radar.azimuth_scale_sigma and "
        "radar.elevation_scale_sigma accordingly, or calibrate the lens with a board, whose result says how well it is known",
        CalibrateLens(),
    )


def units_suspected(
    *, nearest: float = 0.0, farthest: float = 0.0, unit: str = "", factor: float = 1.0, camera_away: float = 0.0
) -> Remark:
    """Given when radar positions, or the measured camera position, are too far away for meters.

    Could also be: feet, if no camera position is measured: every length, the pose's too, is then in feet.
    """
    if camera_away:
        return remark(
            f"the measured camera position is {camera_away:,.0f} m from the radar: is it in meters?",
            "the camera position must be in meters",
            MeasureCameraPosition(),
        )
    return remark(
        f"the radar positions are {nearest:,.0f} to {farthest:,.0f} m away: the ranges look like {unit}",
        f"radar positions must be in meters: multiply them by {factor:g}",
    )


def pixels_suspected(
    *,
    clicks: int = 0,
    width_px: int = 0,
    height_px: int = 0,
    outside: int = 0,
    exchanged: bool = False,
    pair: str = "",
    pixel_px: Sequence[float] = (),
    reach: Sequence[float] = (),
    principal_point_px: Sequence[float] = (),
    mode: str = "",
) -> Remark:
    """Given when clicks are outside the image, or would be inside with column and row exchanged, or all are in its upper
    left part; or when the principal point is outside the image, or far from its middle where the pairs object too.

    Could also be: an image that was cropped.
    """
    if principal_point_px:
        return _off_middle(principal_point_px, width_px, height_px, mode)
    image = f"the {width_px} x {height_px} image"
    if exchanged:
        return remark(
            f"{outside} of {clicks} clicks are outside {image}, and with column and row exchanged all are inside",
            "give each pixel as (column, row)",
        )
    if not reach:
        u_px, v_px = pixel_px
        return remark(
            say(
                "{outside} of {clicks} clicks are outside {image}, such as {pair} at ({u_px:.0f}, {v_px:.0f})",
                outside=outside,
                clicks=clicks,
                image=image,
                pair=named(pair),
                u_px=u_px,
                v_px=v_px,
            ),
            "check that the intrinsics belong to an image of the size that was clicked; remove the pair otherwise",
            ReviewPairs((pair,)),
        )
    across, down = reach
    return remark(
        f"all clicks are in the upper left {100 * across:.0f} x {100 * down:.0f} % of {image}: the clicked image seems to be "
        "smaller",
        "scale the clicks, or the intrinsics, to the same size of the image",
        CalibrateLens(),
    )


def _off_middle(principal_point_px: Sequence[float], width_px: int, height_px: int, mode: str) -> Remark:
    u_px, v_px = principal_point_px
    middle = f"; it is near the middle of a {mode} image of the same sensor" if mode else ""
    return remark(
        f"the principal point ({u_px:.0f}, {v_px:.0f}) is far from the middle of the {width_px} x {height_px} image{middle}: the "
        "intrinsics seem to be of another image, and the pose turned accordingly",
        "use the intrinsics of this image size and mode, or calibrate the lens with a board; those of a part of the sensor's "
        "image state it as roi",
        CalibrateLens(),
    )


def principal_point_off(*, right: float, down: float) -> Remark:
    """Given when the principal point is 5 to 12 % of the image's width or height from its middle, farther than published
    calibrations of usual cameras have it.

    Could also be: a lens that is mounted so, as in some webcams: then nothing is wrong.
    """
    aside = f"{100 * abs(right):.0f} % to the {'right' if right > 0.0 else 'left'}"
    above = f"{100 * abs(down):.0f} % {'below' if down > 0.0 else 'above'}"
    return remark(
        f"the principal point is {aside} and {above} the middle of the image, "
        "farther than usual: if the intrinsics belong to another image, the pose is turned by as much, and no residual shows it",
        "make sure that the intrinsics are those of this camera, image size and crop; a board calibration says how well it knows "
        "the principal point",
        CalibrateLens(),
    )


def one_row(*, row_px: float, spread_px: float) -> Remark:
    """Given when near and far placements were clicked in nearly one row of the image: the pairs then put the camera at their
    height, whatever the radar says.

    Could also be: a reflector on a tripod as high as the camera: then nothing is wrong.
    """
    return remark(
        f"all clicks are within a few pixels of row {row_px:.0f} (spread {spread_px:.1f} px): that is right only if the "
        "reflector was as high as the camera at every placement",
        "make sure that the clicks are on the reflector, not on the horizon; place it at several heights",
    )


def radar_axes_suspected(*, side: str, behind: int, pairs: int) -> Remark:
    """Given when by the given axes the placements are beside the radar or behind it.

    Could also be: axes that differ by less than 60 deg: the pose absorbs any rotation.
    """
    where = "behind the radar" if side == "behind" else f"to the {side} of the radar"
    axes = {"left": "right,forward,up", "right": "left,backward,up"}.get(side, "backward,right,up")
    return remark(
        f"the placements are {where}, and {behind} of {pairs} radar positions have x below 0: their frame seems not to be the "
        "radar's",
        say(
            "radar axes must be x forward, y left, z up, with the origin at the radar; if they are turned, read them with "
            "{axes}; the pose is right for the given axes, but a camera position, and the noise of the angles, refer to the "
            "radar's own",
            axes=option("radar_axes", axes),
        ),
        SetOption("radar_axes", axes),
    )


_NEARLY_SURE = 0.995


def probability_text(probability: float) -> str:
    """Write a probability with two digits; one that would round to 1 as "> 0.99"."""
    return "> 0.99" if probability >= _NEARLY_SURE else f"{probability:.2f}"


def nobody_confirmed(*, placed: int, clicks: int, confidence: float) -> Remark:
    """Given when clicks were placed by `cocalib solve --auto`, or come from a file that it wrote.

    Could also be: see [proposals.md](proposals.md).
    """
    of_all = f"all {clicks} clicks were" if placed == clicks else f"{placed} of {clicks} clicks were"
    return remark(
        f"{of_all} placed automatically (confidence {probability_text(confidence)}), and are unconfirmed",
        "confirm each of them on the page: open the recording with the clicks that solve --auto --clicks-out wrote",
    )


_COPY_AGAIN = "copy the recording again from its source"


def damaged_recording(*, lost: int, share: float, damage: DataWarning) -> Remark:
    """Given when a part of the recording is damaged or missing, and radar data are lost in the window of a click, or for more
    than 5 % of the time; `provenance.damage` in calibration-1 states damage in any case.

    Could also be: a file that was cut off while it was copied.
    """
    part = (
        f"radar data are lost at {count(lost, 'click')}" if lost else f"{100 * share:.0f} % of the radar data are lost"
    )
    return remark(f"{part}: {warning_remark(damage).message}", _COPY_AGAIN)


def radar_missing(*, lost: int, clicks: int, damage: DataWarning | None) -> Remark:
    """Given when more than a quarter of the clicks have no radar data: the recording is damaged, or its radar was not running.

    Could also be: clocks that are apart.
    """
    why = "" if damage is None else f": {warning_remark(damage).message}"
    hint = "use a recording with radar data at every click, or check that both clocks agree"
    return remark(f"{lost} of {clicks} clicks have no radar data{why}", hint if damage is None else _COPY_AGAIN)


def radar_mostly_missing(*, lost: int, clicks: int, damage: DataWarning | None) -> Remark:
    """Given when more than half of the clicks have no radar data: the others are a part that nobody chose.

    Could also be: the same causes as of radar-missing.
    """
    return radar_missing(lost=lost, clicks=clicks, damage=damage)


def lost_returns(*, lost: int, read: int, where: str) -> Remark:
    """Given when returns around the clicks, or more than 5 % of all that were read, have positions that are not numbers and
    are not marked as invalid (by a flag, or by a cloud that is not dense and has valid ones), or lie in their message
    beyond the number that it states; fewer, elsewhere, are one line of `cocalib info`.

    Could also be: the radar's driver, or the program that wrote the recording.
    """
    return remark(
        f"{lost} of {read} returns of {where} are lost ({100 * lost / read:.3g} %): their positions are not numbers or no ranges "
        "and angles, or their messages hold more returns than they state",
        "look for the fault in the radar's driver or in the program that wrote the recording; the reflector may be among them",
    )


def radar_in_vehicle_frame(
    *, frame: str, by_name: str, by_data: str, mounted: bool, stated: bool, place_m: Sequence[float] = ()
) -> Remark:
    """Given when the returns may have been moved out of the radar's frame into a vehicle's, such as base_link, and are not taken
    back: its frame_id and the returns themselves contradict each other or cannot tell, or the radar's mount is not known.

    Could also be: returns in the radar's frame under another's name.
    """
    place = ", ".join(f"{axis} {value:.2f}" for axis, value in zip("xyz", place_m, strict=False)) + " m" * bool(place_m)
    said = {
        "sensor": "measured at the origin of their frame, so in the radar's own",
        "body": f"measured at {place or 'the mount of the radar'}, so moved into the vehicle's frame",
        "unknown": "of no certain origin",
    }
    name = "" if by_name == "unknown" else f"by its name {'a vehicle' if by_name == 'body' else 'the radar'}'s; "
    seen = "as stated a vehicle's" if stated else f"{name}by the returns themselves they are {said[by_data]}"
    by_body = say("{frame} {mount}", frame=option("radar_frame", "body"), mount=option("radar_mount"))
    return remark(
        f"the returns are in the frame '{frame}', {seen}; if they are in a vehicle's, the pose is that of this frame, and its "
        "uncertainty is too small: the radar's noise and angle errors are about the radar's own place and axes",
        say(
            "if they are in the vehicle's frame, they are taken back with {body}; if they are in the radar's own, say {sensor}",
            body=option("radar_frame", "body") if mounted else by_body,
            sensor=option("radar_frame", "sensor"),
        ),
        SetOption("radar_frame") if mounted else SetOption("radar_mount"),
    )


def choices_unused(*, clicks: int) -> Remark:
    """Given when Algorithm 1 only: a return was chosen for a click, which it does not use: it averages all static returns
    of a window.
    """
    which = "the chosen return of 1 click" if clicks == 1 else f"the chosen returns of {clicks} clicks"
    return remark(
        f"Algorithm 1 averages all static returns of a window, so {which} had no effect",
        "use the default method, which keeps to the choice",
        SetOption("method", "default"),
    )


def placement_ranges(*, chosen: int, by_score: int, region_m: float) -> Remark:
    """Given when Algorithm 1 only: returns far from a placement were left out, and it says where the placements come from: the
    returns that a person chose, or else the radar's own candidates with the highest score.
    """
    return remark(
        f"placement ranges of {region_m:g} m: {chosen} chosen, {by_score} by the radar's score",
        "choose the return of a pair whose placement the radar does not show clearly",
    )


def behind_camera(*, ids: Sequence[str], pairs: int) -> Remark:
    """Given when Algorithm 1 only: its pose puts radar positions behind the camera."""
    return remark(
        say(
            "with this pose the camera cannot see {hidden} of {pairs} radar positions ({ids}); the metrics exclude them",
            hidden=len(ids),
            pairs=pairs,
            ids=listed(ids),
        ),
        "do not use this pose; use the default method",
        SetOption("method", "default"),
    )


def no_camera() -> Remark:
    return remark(
        "No camera in this recording: nothing can be clicked",
        "add the camera's file to calibrate: cocalib open RADAR CAMERA",
    )


def camera_turned(*, turned_deg: float, last_s: float, first_s: float, ids: Sequence[str], before: bool) -> Remark:
    """Given when the still image shows that the camera turned between two placements, by more than a click is off by.

    Could also be: a camera that was moved by centimeters.
    """
    return remark(
        say(
            "the camera turned {turned:.2f}° between {last} and {first} after the first click; {ids} {side} it",
            turned=turned_deg,
            last=_clock(last_s),
            first=_clock(first_s),
            ids=listed(ids),
            side="are before" if before else "are after",
        ),
        "solve the placements before and after it on their own, with the others excluded, and fasten the camera",
        ReviewPairs(tuple(ids)),
    )


def _clock(seconds: float) -> str:
    return f"{int(seconds // 60)}:{int(seconds % 60):02d}"


def carried_forward(*, turned_deg: Mapping[str, float], sha256: str) -> Remark:
    turns = ", ".join(f"{axis} {turn:+.2f}°" for axis, turn in turned_deg.items())
    return remark(
        f"carried forward from {sha256[:12]}... by a watched turn ({turns}); pairs and figures are those of the older solve",
        "it rests on the older calibration and its baseline: write a new baseline, and calibrate again when you can",
    )


SOLVER = by_code(
    agreeing_outliers,
    algorithm_1_contradicted,
    angle_scale,
    behind_camera,
    camera_far_away,
    camera_position_contradicted,
    camera_position_doubtful,
    camera_turned,
    choices_unused,
    clock_bias_suspected,
    clocks_apart,
    damaged_recording,
    excluded_by_residual,
    few_pairs,
    flat_radar,
    handedness_assumed,
    handedness_open,
    intrinsics_suspected,
    lens_or_radar_scale,
    lost_returns,
    many_outliers,
    mirrored_axes,
    no_consensus,
    nobody_confirmed,
    one_pair_decides,
    one_row,
    pixels_suspected,
    placement_ranges,
    principal_point_off,
    radar_axes_suspected,
    radar_in_vehicle_frame,
    radar_missing,
    radar_mostly_missing,
    repeated_placements,
    residuals_too_large,
    shared_error_suspected,
    smooth_angle_errors,
    two_poses,
    uncertain_association,
    units_suspected,
    weak_geometry,
)
ROWS: Mapping[str, Row] = {
    **SOLVER,
    **intrinsics.WARNINGS,
    **evaluation.WARNINGS,
    **by_code(no_camera, carried_forward),
}


def warning_remark(warning: DataWarning) -> Remark:
    """Return what a warning says: by its row, or as it was reported with it."""
    return by_row(warning, ROWS)
