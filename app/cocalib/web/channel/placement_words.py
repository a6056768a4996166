"""What the placements of a recording are good for, in words and figures: enough to decide whether to record again."""

from collections.abc import Sequence

from calib_core.measurements import MIN_PAIRS
from cocalib.view import Figure
from cocalib.view.wording import plain
from cocalib.web.messages import PlacementRow

SHORTEST_S = 2.0
"""A placement lasts at least this long [s]."""
_SHORT_S = 3.0
"""A click averages the returns of this time [s]; a shorter placement has fewer."""
_LITTLE_DB = 6.0
"""A reflector that stands out less may be taken for clutter."""


def placement_note(lasted_s: float, stands_out_db: float | None) -> str:
    """Return what is unusual about a placement; "" if nothing is.

    Args:
        lasted_s: how long it stood still [s].
        stands_out_db: above the strongest other static returns; None if unknown.
    """
    notes = [f"lasted only {lasted_s:.1f} s"] if lasted_s < _SHORT_S else []
    if stands_out_db is not None and stands_out_db < _LITTLE_DB:
        notes.append(
            f"only {stands_out_db:.0f} dB above other returns"
            if stands_out_db >= 0
            else f"{-stands_out_db:.0f} dB weaker than other returns"
        )
    return ", ".join(notes)


def placement_summary(rows: Sequence[PlacementRow], length_s: float) -> str:
    """Return one line about all placements: how many, where, the strongest, and those to look at.

    Args:
        rows: the placements.
        length_s: of the recording [s].
    """
    if length_s < SHORTEST_S:
        return f"The recording is {length_s:.1f} s long, too short for a placement of {SHORTEST_S:.0f} s or longer"
    if not rows:
        return (
            f"No placement found: nothing appeared, stood still for {SHORTEST_S:.0f} s or longer, and went away again"
        )
    ranges = [row.range_m for row in rows]
    words = [
        f"{len(rows)} placement{'s' if len(rows) > 1 else ''} found, {min(ranges):.1f} to {max(ranges):.1f} m, "
        f"azimuth {_azimuths(rows)}"
    ]
    if len(rows) < MIN_PAIRS:
        words.append(f"a calibration needs at least {MIN_PAIRS}")
    known = [(row.snr_db, number) for number, row in enumerate(rows, start=1) if row.snr_db is not None]
    if known:
        words.append(f"strongest: placement {max(known)[1]}, {max(known)[0]:.0f} dB")
    odd = [f"placement {number} {row.note}" for number, row in enumerate(rows, start=1) if row.note]
    words += odd[:2]
    if len(odd) > 2:
        words.append(f"{len(odd) - 2} more to look at")
    return "; ".join(words)


def placement_figures(rows: Sequence[PlacementRow], returns_per_scan: float, scans_per_s: float) -> tuple[Figure, ...]:
    """Return the figures about a recording without pictures.

    Args:
        rows: the placements.
        returns_per_scan: mean number of returns.
        scans_per_s: scans per second; NaN if there are too few.
    """
    count = Figure(
        "placements", "placements", str(len(rows)), "", "Places where something appeared, stood still, and went away again.",
        "good" if len(rows) >= MIN_PAIRS else "warning",
    )  # fmt: skip
    ranges, known = [row.range_m for row in rows], [row.snr_db for row in rows if row.snr_db is not None]
    span = f"{min(ranges):.1f}–{max(ranges):.1f}" if rows else "–"
    strength = f"{min(known):.0f}–{max(known):.0f}" if known else "–"
    return (
        count,
        Figure("range", "range", span, "m", "Distance of the nearest and of the farthest placement from the radar."),
        Figure(
            "amplitude", "amplitude", strength, "dB", "Mean amplitude of the weakest and of the strongest placement."
        ),
        Figure("returns", "returns a scan", plain(returns_per_scan), "", "Mean number of returns of a radar scan."),
        Figure("rate", "scans", plain(scans_per_s), "Hz", "Radar scans per second."),
    )


def _azimuths(rows: Sequence[PlacementRow]) -> str:
    azimuths = [row.azimuth_deg for row in rows]
    return f"{_side(min(azimuths))} to {_side(max(azimuths))}"


def _side(azimuth_deg: float) -> str:
    rounded = round(azimuth_deg)
    return "0°" if rounded == 0 else f"{abs(rounded)}° {'left' if rounded > 0 else 'right'}"
