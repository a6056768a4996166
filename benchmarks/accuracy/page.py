"""Write docs/accuracy.md and its tables from kept figures."""

import csv
import io
from collections.abc import Mapping, Sequence

from benchmarks.accuracy.figures import MISSED
from benchmarks.accuracy.rows import Section

_HEAD = """# Accuracy

Written by `{command}`; do not edit. Each question has a short table of aims here, and all its rows, with the
aim and the verdict of each, in a file beside the benchmark. Real pairs and recordings have [a page of their own](real.md).

## What a user may conclude

- **The stated 95 % holds** if radar, lens, clicks and measured position are wrong by no more than the options state, with
  12 pairs or more spread over the image, about one in ten of them wrong, and right axes, units and intrinsics{held}.
{outside}
  The region is mostly larger than it need be, for it allows for smooth errors: see the stated sigma over the RMSE.
- **Measure the camera position.** {tape}
- **Some errors no pair can show:** clicks that are all beside the point that the radar sees, and elevations that are all
  wrong alike. The verdict says that it assumes neither; a measured position shows most of both, with an imaging radar all. An
  image that was cropped after its intrinsics were measured is named where its principal point is far from the middle. Clicks that
  were set where a wrong pose drew the returns, and an image squeezed along one axis, are shown by no position either.
- **{missed} of {aims} aims are missed.** They are in bold below, with the rows that miss them.

## How it was measured

Everything is simulated. Noise and shared errors are drawn from the model that the estimator assumes, so those sections
test its statistics and not the model; smooth errors, presets and defects depart from it. There is a seed per
set, so that the number of processors changes no figure. {seeds}

Noise levels are assumptions from vendors' figures: `ti` is a TI AWR1843 (range 1.5 cm, azimuth 0.55 deg, elevation 1 deg),
`ti_aisle` the same in a narrow aisle (2 cm, 0.8, 2), `ti_fine` with interpolated peaks (0.8 cm, 0.2, 0.7), `imaging` an imaging
radar (3 cm, 0.12, 0.25); clicks have 2 px in a 1920 x 1080 image of 75 deg. Placements are 2 to 20 m away. "Free" means that
the camera position is not measured, "tape" that it is, to 1 cm per axis. *Inside*: the true pose is in the stated 95 %
ellipsoid. *Good*, *usable* and *coarse* are the verdict's levels. *Silent* and *misleading* answers are far outside without a
warning that names the cause; the section on defects defines both. RMSE is the root mean square of the angle or distance.

Aims without a reason are choices. c35a642 is an earlier version of cocalib.

After ± are two standard errors (of shares with two successes and two failures added); "upper limit" is one-sided, 95 %.
"Met": the figure reaches the aim. "Undecided": it does not, by less than two standard errors.
"Missed": by more; of forty rows where nothing is wrong, one is missed by chance.
"""

_FIXED = "The draws are those of fixed seeds, which development may have seen."
_FRESH = "The draws come from a commit's hash, {commit}, after the code and the aims in it were written: nobody had seen them."


def page(
    sections: Mapping[str, Section],
    *,
    commit: str = "",
    command: str = "make bench-accuracy",
    counts: tuple[int, int] = (0, 0),
) -> str:
    """Return the page in Markdown; what was not measured is left out.

    Args:
        sections: the measured questions by the name of their table.
        commit: whose hash gave the seeds; empty for the fixed ones.
        command: what wrote the page.
        counts: sets that were measured, and those of a whole run.
    """
    claims = [claim for section in sections.values() for claim in section.claims]
    outside = [
        f"  - {section.title.partition(':')[0]}: {'; '.join(section.outside)}."
        for section in sections.values()
        if section.outside
    ]
    head = _HEAD.format(
        command=command,
        held=_held(sections),
        outside="\n".join(["  It does not in these rows, with so many inside:", *outside] if outside else []),
        tape=_tape(sections),
        missed=sum(claim.verdict == MISSED for claim in claims),
        aims=len(claims),
        seeds=f"{_FRESH.format(commit=commit[:8]) if commit else _FIXED} {_counted(*counts)}",
    )
    return "\n".join([head, *(_section(name, section) for name, section in sections.items())])


def _counted(measured: int, whole: int) -> str:
    cut = f" of {whole:,}: the run was cut, after about the same share of each row" if measured < whole else ""
    return f"These are {measured:,} sets{cut}."


def _held(sections: Mapping[str, Section]) -> str:
    """Say how many sets are inside, without and with smooth errors."""
    shown = [sections["shared"].claims[0].measured] if "shared" in sections else []
    smooth = sections["smooth"].claims if "smooth" in sections else ()
    shown += [
        f"{claim.measured} with {claim.aim.partition(':')[0]}" for claim in smooth if claim.aim.endswith("inside")
    ]
    return f": inside are {', '.join(shown)} angle errors" if shown else ""


def _tape(sections: Mapping[str, Section]) -> str:
    """Say what a position to 1 cm changes with 20 pairs."""
    rows = {row["row"]: row for row in sections["shared"].rows} if "shared" in sections else {}
    told = []
    for noise in ("ti", "imaging"):
        ends = [rows.get(f"{noise} 20 {known}") for known in ("free", "tape")]
        errors = [f"{row['rotation [deg]']} deg and {row['position [cm]']} cm" for row in ends if row]
        told += [f"with `{noise}`, {' become '.join(errors)}"] if errors else []
    return f"With 20 pairs (RMSE): {'; '.join(told)}."


def _section(name: str, section: Section) -> str:
    lines = [
        f"## {section.title}\n",
        section.text + f" All rows: [{name}.csv](../benchmarks/accuracy/tables/{name}.csv).\n",
    ]
    lines += ["| aim | measured |  |", "|---|---|---|"]
    lines += [f"| {claim.aim} | {claim.measured} | {claim.verdict} |" for claim in section.claims]
    return "\n".join(lines) + "\n"


def table(rows: Sequence[Mapping[str, str]]) -> str:
    """Write rows of the same columns as CSV."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: value.replace("**", "") for name, value in row.items()} for row in rows)
    return stream.getvalue()
