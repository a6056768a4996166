"""The figures of an evaluation in words: what `evaluate` prints, and what the report says next to its plots."""

import numpy as np

from calib_core.evaluation.figures import BoxFigures, Evaluation, HeldOut, ResidualFigures, Sensitivity, Share, Spread
from calib_core.words.outcomes import said_of
from calib_core.words.unpaired import unpaired_remark

NOT_ACCURACY = (
    "Acc is not accuracy: a pose that is wrong by half a degree can score as well as the right one, or better; judge a pose "
    "by its residuals and error bars"
)
_NAMED = 5
_LEAST_RETURNS = 3  # of a target that is named
_CLEARLY_HIGHER = 0.005


def evaluation_lines(evaluation: Evaluation) -> tuple[str, ...]:
    """Return an evaluation as lines of text, the answer first."""
    rows: list[str] = []
    if evaluation.residuals is not None:
        rows += _residual_lines(evaluation.residuals)
    if evaluation.boxes is not None:
        rows += _box_lines(evaluation.boxes)
    rows += [f"warning: {said_of(warning)}" for warning in evaluation.warnings]
    return tuple(rows)


def residual_sentence(figures: ResidualFigures) -> str:
    """Return AED, CDSD and median, and how many clicks they come from."""
    placements = len(np.unique(figures.placements)) or len(figures.ids)
    lost = len(figures.ids) - figures.metrics.n
    behind = f"; {lost} more would be behind the camera" if lost else ""
    return (
        f"residuals: mean reprojection error (AED) {_px(figures.metrics.aed_px)}, CDSD {_px(figures.metrics.cdsd_px)}, "
        f"median {_px(figures.median_px)}, {_percent(figures.inlier_share)} inliers ({_count(figures.metrics.n, 'click')} at "
        f"{_count(placements, 'placement')}{behind})"
    )


def acc_sentence(figures: BoxFigures) -> str:
    """Return Acc with its standard error, and how many frames and returns it comes from."""
    counting = sum(1 for frame in figures.frames if frame.returns)
    returns = sum(frame.returns for frame in figures.frames)
    if figures.acc is None:
        return f"Acc: none, because no frame has a return of a {_noun(figures)}"
    error = figures.acc_standard_error
    plus_minus = f" +- {100.0 * error:.1f} %" if np.isfinite(error) else ", standard error unknown"
    return (
        f"Acc: {100.0 * figures.acc:.1f} %{plus_minus} ({_count(counting, 'frame')}, {_count(returns, 'return')} of "
        f"{_count(figures.targets, _noun(figures))}, {figures.matched_targets} of them with boxes)"
    )


def _noun(figures: BoxFigures) -> str:
    return "labeled object" if figures.by_cuboid else "moving target"


def sensitivity_sentences(figures: BoxFigures) -> tuple[str, ...]:
    """Say for each axis what Acc sees of it within a degree."""
    return tuple(map(_sensitivity_sentence, figures.sensitivity))


def _sensitivity_sentence(curve: Sensitivity) -> str:
    at = dict(zip(curve.angles_deg, curve.acc, strict=True))
    low, high = min(curve.angles_deg), max(curve.angles_deg)
    if curve.is_flat:
        return (
            f"Acc is flat in {curve.axis}: it cannot see it ({_percent(min(curve.acc))} to {_percent(max(curve.acc))})"
        )
    best, interval = curve.best_deg, ""
    if np.isfinite([curve.low_deg, curve.high_deg]).all():
        interval = f"; {curve.low_deg:+g} to {curve.high_deg:+g} deg with 95 %"
    ends = f"{_percent(at[low])} at {low:+g} deg, {_percent(at[high])} at {high:+g} deg"
    highest = f", highest at {best:+g} deg ({_percent(max(curve.acc))}{interval}), not here"
    where = highest if max(curve.acc) - at[0.0] >= _CLEARLY_HIGHER else ""
    return f"Acc under {curve.axis}: {_percent(at[0.0])} here, {ends}{where}"


def _residual_lines(figures: ResidualFigures) -> list[str]:
    rows = [residual_sentence(figures)]
    if figures.held_out is not None and figures.k_fold is not None:
        rows.append(
            f"leave-one-out: {_held_out_text(figures.held_out)} by placement, {_held_out_text(figures.k_fold)} with "
            f"{_count(figures.k_fold.folds, 'group')} of placements; independent of the evaluated calibration"
        )
    rows.append(f"  {figures.association}")
    if figures.unpaired:
        rows.append(
            f"  {_count(len(figures.unpaired), 'click')} without a radar position: {unpaired_remark(figures.unpaired[0]).message}"
        )
    named = (("range", "m"), ("azimuth", "deg"), ("column", "px"), ("row", "px"))
    for (name, unit), bins in zip(
        named, (figures.by_range, figures.by_azimuth, figures.by_column, figures.by_row), strict=True
    ):
        if bins:
            rows.append(f"  AED by {name} [{unit}]: {', '.join(map(_bin, bins))}")
    far = [name for name, inlier in zip(figures.ids, figures.inliers.tolist(), strict=True) if not inlier]
    if far:
        rows.append(f"  not explained by noise: {', '.join(far[:_NAMED])}{', ...' if len(far) > _NAMED else ''}")
    return rows


def _box_lines(figures: BoxFigures) -> list[str]:
    rows = [acc_sentence(figures)]
    if figures.acc is None:
        return [*rows, f"  {figures.rule}"]
    rows += [f"  {sentence}" for sentence in sensitivity_sentences(figures)]
    rows.append(f"  {NOT_ACCURACY}")
    rows += [
        f"  {one.label or 'without a box'}: {_percent(one.acc)} ({_count(one.frames, 'frame')}, {_count(one.returns, 'return')})"
        for one in figures.classes
    ]
    worst = sorted((one for one in figures.objects if one.returns >= _LEAST_RETURNS), key=lambda one: one.acc or 0.0)
    if len(worst) > 1:
        shares = (f"{one.label} {_percent(one.acc)} ({_count(one.returns, 'return')})" for one in worst[:_NAMED])
        rows.append(
            f"  by {_noun(figures)}, the lowest first: {', '.join(shares)}{', ...' if len(worst) > _NAMED else ''}"
        )
    rows.append(f"  by range [m]: {', '.join(_share(one) for one in figures.ranges if one.returns)}")
    zero = sum(1 for frame in figures.frames if frame.returns and not frame.inside)
    rows.append(
        f"  {_count(zero, 'frame')} of 0 % {'is' if zero == 1 else 'are'} kept; without, as the paper's published script counts, "
        f"{_percent(figures.acc_without_zero_frames)}"
    )
    rows.append(
        f"  chance: turned by 10 deg to either side {_percent(figures.chance)}; the boxes cover {_percent(figures.area_chance)} "
        "of the image"
    )
    rows.append(f"  {figures.rule}")
    return rows


def _held_out_text(figures: HeldOut) -> str:
    lost = int(np.isnan(figures.distances_px).sum())
    unsolved = f" ({_count(lost, 'click')} not predicted)" if lost else ""
    return f"AED {_px(figures.aed_px)}{unsolved}"


def _bin(spread: Spread) -> str:
    value = f"{spread.mean_px:.3g}" if spread.n else "-"
    return f"{spread.low:g} to {spread.high:g}: {value} ({spread.n})"


def _share(share: Share) -> str:
    return f"{share.low_m:g} to {share.high_m:g}: {_percent(share.inside / share.returns)} ({share.returns})"


def _px(value: float) -> str:
    return f"{value:.3g} px" if np.isfinite(value) else "unknown"


def _percent(share: float | None) -> str:
    return "unknown" if share is None or not np.isfinite(share) else f"{100.0 * share:.1f} %"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"
