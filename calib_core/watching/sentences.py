"""What a watch says: which sensor has turned, by how much, since when, and what would have been noticed."""

import json
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Final

import numpy as np

from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.watching.baseline import Baseline
from calib_core.watching.witnesses import AXES, SeenTurn, Verdict

_WAYS: Final = (("down", "up"), ("left", "right"), ("counterclockwise", "clockwise"))
"""How a camera turned about x, y and z if what it sees moves by a positive or negative angle."""
_RADAR_WAYS: Final = (("counterclockwise", "clockwise"), ("up", "down"), ("right", "left"))
"""How a radar did, about its x, y and z."""
_RADAR_AXES: Final = ("roll", "pitch", "yaw")
_NINETY_FIVE = 1.96
_CLOCK_SIGMAS = 5.0
_USUAL_RANGE_M = 10.0
LEAST_TRAFFIC_S = 600.0
"""A baseline with less traffic is the largest error of a change."""

FINDINGS: Final[Mapping[str, str]] = {
    "turned": "the camera and the radar turned against each other: calibrate again, or carry it forward with --update",
    "radar_turned": "the radar turned in the world: calibrate again, unless the camera turned with it",
    "mast_turned": "the mast turned, the calibration holds: camera and radar turned alike in the world",
    "camera_moved": "the camera moved; whether the radar moved with it cannot be seen: give boxes of traffic with --boxes",
    "traffic_denies": "the still image says that the camera moved, and traffic, which would show it, does not: look at both",
    "nothing": "nothing has moved since the baseline, as far as can be seen",
    "too_little": "too little to say whether anything moved: record longer, or give boxes of traffic with --boxes",
}
"""A sentence for each finding."""


def verdict_lines(verdict: Verdict) -> Iterator[str]:
    """Yield the finding, what would have been noticed, and what each witness says."""
    yield FINDINGS[verdict.finding]
    if verdict.finding in ("turned", "mast_turned") and verdict.change is not None:
        yield from _turns("camera", verdict.change, _WAYS, against=" against the radar", all_axes=False)
    yield f"camera against radar: {_noticed(verdict.noticed_rad)}"
    for name, who, seen, ways in (
        ("still image", "camera", verdict.image, _WAYS),
        ("still returns", "radar", verdict.returns, _RADAR_WAYS),
        ("traffic", "camera", verdict.traffic, _WAYS),
    ):
        if seen is None:
            yield f"{name}: says nothing here"
            continue
        where = " against the radar" if name == "traffic" else " in the world"
        of = f" ({seen.passages} passages)" if seen.passages else ""
        for line in (*_turns(who, seen, ways, against=where, all_axes=True), *_late(seen)):
            yield f"{name}{of}: {line}"


def _turns(
    who: str, seen: SeenTurn, ways: tuple[tuple[str, str], ...], *, against: str, all_axes: bool
) -> Iterator[str]:
    """Yield a phrase for each axis about which something turned; one that nothing did, if none."""
    named = [axis for axis in range(3) if seen.turned[axis]]
    for axis in named:
        yield turn_text(who, seen, axis, ways[axis], against=against)
    if not named and all_axes:
        order = [1, 2, 0] if who == "radar" else [0, 1, 2]  # roll, pitch and yaw are about x, y and z of a radar
        yield f"no turn of the {who}{against} seen; {_noticed(seen.noticed_rad[order])}"


def _late(seen: SeenTurn) -> Iterator[str]:
    """Yield a change of the offset between the clocks, if traffic shows one."""
    if seen.late_s is not None and abs(seen.late_s[0]) > _CLOCK_SIGMAS * seen.late_s[1]:
        late, sigma = (1e3 * one for one in seen.late_s)
        low, high = abs(late) - _NINETY_FIVE * sigma, abs(late) + _NINETY_FIVE * sigma
        way = "later" if late > 0 else "earlier"
        yield f"images are stamped {abs(late):.0f} ms {way} (95 %: {low:.0f} to {high:.0f}) against scans than in the baseline"


def turn_text(who: str, seen: SeenTurn, axis: int, ways: tuple[str, str], *, against: str = "") -> str:
    """Return a turn about one axis in words, with its interval, since when, and what else would look like it."""
    turn, sigma = (float(np.rad2deg(one[axis])) for one in (seen.rotation_rad, seen.sigma_rad))
    way = ways[0] if turn >= 0 else ways[1]
    low, high = abs(turn) - _NINETY_FIVE * sigma, abs(turn) + _NINETY_FIVE * sigma
    since = "" if seen.since is None else f" since {clock_text(seen.since)}"
    range_m = seen.range_m if np.isfinite(seen.range_m) else _USUAL_RANGE_M
    move = (
        ""
        if way.endswith("clockwise")
        else f"; or a move of {_length(np.deg2rad(abs(turn)) * range_m)} (at {range_m:.0f} m)"
    )
    weak = ", which is weak" if way.endswith("clockwise") and against == " against the radar" else ""
    return f"{who} turned {way} {abs(turn):.2f}° (95 %: {low:.2f} to {high:.2f}){against}{since}{weak}{move}"


def _noticed(noticed_rad: np.ndarray) -> str:
    """Return which turns would have been noticed."""
    seen = [
        f"{np.rad2deg(one):.2g}° of {axis}" for axis, one in zip(AXES, noticed_rad, strict=True) if np.isfinite(one)
    ]
    blind = [axis for axis, one in zip(AXES, noticed_rad, strict=True) if not np.isfinite(one)]
    parts = [f"{', '.join(seen)} would have been noticed"] if seen else []
    return "; ".join([*parts, *([f"{' and '.join(blind)} cannot be seen"] if blind else [])])


def _length(metres: float) -> str:
    return f"{100.0 * metres:.0f} cm" if metres < 1.0 else f"{metres:.1f} m"


def clock_text(time: TimeNs) -> str:
    """Return a stamp as time of day in UTC; a stamp of the first day since the epoch as seconds."""
    seconds = time / NS_PER_S
    return f"{seconds:.1f} s" if seconds < 86_400 else datetime.fromtimestamp(seconds, UTC).strftime("%H:%M:%S")


def baseline_lines(baseline: Baseline) -> Iterator[str]:
    """Yield what a baseline rests on, and what is weak in it."""
    seconds = (baseline.end - baseline.start) / NS_PER_S
    traffic = baseline.traffic
    parts = [f"{len(baseline.backgrounds)} still images"] if baseline.backgrounds else []
    parts += [f"{len(baseline.still_returns)} still returns"] if baseline.still_returns is not None else []
    parts += [f"{sum(traffic.passages)} passages ({', '.join(traffic.labels)})"] if traffic is not None else []
    yield f"baseline: {baseline.recording}, {seconds:.0f} s: {', '.join(parts)}"
    if traffic is not None and traffic.seconds < LEAST_TRAFFIC_S:
        yield (
            f"note: the baseline has {traffic.seconds:.0f} s of traffic, which is the largest error of a change; "
            "ten minutes are better"
        )


def json_line(verdict: Verdict, *, at: TimeNs | None, exit_code: int | None = None) -> str:
    """Return what is known as one line of JSON.

    Args:
        verdict: of all witnesses.
        at: the stamp up to which it is known; None at the end.
        exit_code: of the command, at the end.
    """
    content: dict[str, object] = {"finding": verdict.finding, "line": FINDINGS[verdict.finding]}
    if at is not None:
        content["time_ns"] = int(at)
    if exit_code is not None:
        content["exit_code"] = exit_code
    content["would_have_been_noticed_deg"] = _by_axis(np.rad2deg(verdict.noticed_rad))
    for name in ("change", "image", "returns", "traffic"):
        seen: SeenTurn | None = getattr(verdict, name)
        content[name] = None if seen is None else _seen(seen, _RADAR_AXES if name == "returns" else AXES)
    return json.dumps(content)


def _seen(seen: SeenTurn, axes: tuple[str, ...]) -> dict[str, object]:
    turn, sigma = np.rad2deg(seen.rotation_rad), np.rad2deg(seen.sigma_rad)
    return {
        "turn_deg": _by_axis(turn, axes),
        "low_deg": _by_axis(turn - _NINETY_FIVE * sigma, axes),
        "high_deg": _by_axis(turn + _NINETY_FIVE * sigma, axes),
        "turned": [axis for axis, turned in zip(axes, seen.turned, strict=True) if turned],
        "would_have_been_noticed_deg": _by_axis(np.rad2deg(seen.noticed_rad), axes),
        "since_ns": None if seen.since is None else int(seen.since),
        "passages": seen.passages,
        "images_late_s": None if seen.late_s is None else {"change": seen.late_s[0], "sigma": seen.late_s[1]},
    }


def _by_axis(values: np.ndarray, axes: tuple[str, ...] = AXES) -> dict[str, float | None]:
    return {axis: float(one) if np.isfinite(one) else None for axis, one in zip(axes, values, strict=True)}
