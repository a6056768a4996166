"""What is said of a click that has no radar position: a row for each code."""

from calib_core.measurements import Unpaired
from calib_core.results.actions import SetOption
from calib_core.words.remark import Remark, by_code, by_row, remark


def no_scan(*, gap_s: float | None = None, allowed_s: float = 0.0) -> Remark:
    if gap_s is None:
        return remark("the radar recording has no scan", "choose the radar topic that has returns")
    return remark(
        f"the nearest radar scan is {gap_s:.2f} s away; at most {allowed_s:g} s are allowed",
        "click where both recordings overlap, or check that both clocks agree",
    )


def no_static_return(
    *,
    scans: int = 0,
    within_s: float = 0.0,
    fastest_mps: float | None = None,
    nearest_m: float = 0.0,
    farthest_m: float = 0.0,
    paper: bool = False,
    gap_s: float | None = None,
) -> Remark:
    if paper:
        return remark(
            "no radar return passes the velocity and range filter"
            if gap_s is None
            else f"the nearest static radar return is {gap_s:.2f} s away",
            f"Algorithm 1 keeps speeds up to {fastest_mps:g} m/s and ranges below {farthest_m:g} m: click where the reflector "
            "stands still inside the radar recording, or raise these two options",
            SetOption("paper.max_range_m"),
        )
    window = f"none of the {scans} scans within {within_s:g} s has a return"
    if fastest_mps is None:
        return remark(f"{window} with a position", "look at what the radar's driver writes: cocalib info RECORDING")
    return remark(
        f"{window} slower than {fastest_mps:g} m/s between {nearest_m:g} and {farthest_m:g} m",
        "stand clear of the reflector and let it rest for three seconds, or widen the gates",
        SetOption("gating.max_range_m"),
    )


def no_z_score_inlier(*, returns: int, z_score_threshold: float) -> Remark:
    return remark(
        f"none of the {returns} returns in the window is within {z_score_threshold:g} standard deviations on all three axes",
        "raise the z-score threshold, or use the default method",
        SetOption("paper.z_score_threshold"),
    )


def nothing_in_range(*, returns: int, region_m: float) -> Remark:
    return remark(
        f"none of the {returns} returns that Algorithm 1 keeps is within {region_m:g} m of the placement",
        "raise the placement range or the velocity filter, or choose the return of this click",
        SetOption("paper.region_m"),
    )


def chosen_return_missing(*, range_m: float, azimuth_deg: float) -> Remark:
    side = "left" if azimuth_deg > 0 else "right"
    return remark(
        f"the radar has no static return at the chosen position, {range_m:.1f} m away and {abs(azimuth_deg):.1f} deg to the "
        f"{side}",
        "choose another return for this click, or take the choice back",
    )


UNPAIRED = by_code(chosen_return_missing, no_scan, no_static_return, no_z_score_inlier, nothing_in_range)


def unpaired_remark(click: Unpaired) -> Remark:
    """Return why a click has no radar position, and what to do."""
    return by_row(click, UNPAIRED)
