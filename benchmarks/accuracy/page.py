"""Write docs/accuracy.md from kept figures."""

from collections.abc import Sequence

from benchmarks.accuracy.rows import Part, Section

__all__ = ["page"]

_HEAD = """# Accuracy

Written by `COMMAND`; do not edit.

## What a user may conclude

- **The stated 95 % holds.** Where radar, lens, clicks and measured position are wrong as real ones are, the stated region
  contains the truth in about 95 % of the draws: with 12 to 40 pairs, one in ten of them wrong, with and without a measured
  camera position. Where 25, 49 or 81 % of the variance of the radar's angles are smooth over direction (lengths of
  10 to 40 deg), it does in 97, 96 and 91 % of 160 draws each, and in 99 % of 520 without
  (`python -m benchmarks.accuracy.coverage_guard`).
- **Measure the camera position.** With a TI radar and 20 pairs it brings the position from about 15 cm to a few, and shows what
  pairs alone cannot. One that is 3 to 11 cm off is covered by the stated error; one that is 30 cm off is named in at least
  nine of ten draws, and loses its weight in the pose. Of right ones, one in fifty or fewer is called doubtful.
- **The radar decides the angles:** about half a degree with an imaging radar, about one degree with a TI radar, several with a
  TI radar in a narrow aisle, where the verdict says coarse.
- **Some errors no pair can show:** clicks that are all beside the point that the radar sees, elevations that are all wrong
  alike, a cropped image. The verdict says that it assumes none of them. A measured position shows the first two; a turn, such
  as that of a cropped image, it shows with an imaging radar only.
- An answer that is far off, calls itself good or usable and names no cause is *silently wrong*. The tables count them.

## How it was measured

Everything except the real pairs is simulated, with a seed per trial: the figures do not depend on the number of processors, and
every method gets the same draws. SEEDS
"Default" rows draw the errors that real radars, lenses and clicks have from the priors that the options state, and solve with
the default options. "Ideal" rows have nothing but independent noise, and the estimator is told so; the Cramer-Rao bound assumes
the same.

Noise levels are assumptions based on
vendors' figures; no real radar was measured. `ti` is a TI AWR1843 (range 1.5 cm, azimuth 0.55 deg, elevation 1 deg),
`ti_aisle` the same in a narrow aisle (2 cm, 0.8, 2), `ti_fine` with interpolated peaks (0.8 cm, 0.2, 0.7), `imaging` an imaging
radar (3 cm, 0.12, 0.25); clicks have 2 px of noise in a 1920 x 1080 image with a field of view of 75 deg. The field scene
extends from 2 to 20 m, the aisle is 2.4 m wide and 15 m long.

The figure after ± is two standard errors. "Met": the figure reaches the aim. "Undecided": it does not, but by less than two
standard errors, so more trials would be needed. "Missed": it misses the aim significantly; even if nothing is wrong, about
one row in forty is missed by chance.
"""

_FIXED = "The draws are those of fixed seeds, which development may have seen."
_FRESH = "The draws come from a commit's hash, {commit}, after the code was written: nobody had seen them."


def page(sections: Sequence[Section], *, commit: str = "", command: str = "make bench-accuracy") -> str:
    """Return the page in Markdown; what was not measured is left out.

    Args:
        sections: the measured tables, and empty ones.
        commit: whose hash gave the seeds; empty for the fixed ones.
        command: what wrote the page.
    """
    shown = [section for section in sections if any(part.cells for part in section.parts)]
    head = _HEAD.replace("COMMAND", command).replace("SEEDS", _FRESH.format(commit=commit[:7]) if commit else _FIXED)
    aims = tuple(
        (one.aim, one.measured, one.verdict) for section in shown for one in section.claims if one.verdict != "not run"
    )
    table = _table(Part("", ("aim", "measured", ""), aims))
    return "\n".join([head, "## Aims\n", table, *map(_section, shown)])


def _section(section: Section) -> str:
    tables = [_table(part) for part in section.parts if part.cells]
    return "\n".join([f"## {section.title}\n", section.text + "\n", *tables])


def _table(part: Part) -> str:
    lines = [f"### {part.title}\n"] if part.title else []
    lines.append("| " + " | ".join(part.head) + " |")
    lines.append("|---" * len(part.head) + "|")
    lines += ["| " + " | ".join(row) + " |" for row in part.cells]
    return "\n".join(lines) + "\n"
