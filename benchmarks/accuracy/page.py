"""Write docs/accuracy.md from kept figures."""

from collections.abc import Sequence

from benchmarks.accuracy.rows import Claim, Part, Section

__all__ = ["page"]

_HEAD = """# Accuracy

Written by `make bench-accuracy`; do not edit. Everything except the real pairs is simulated, with a fixed seed per trial: the
figures do not depend on the number of processors, and every method gets the same draws. Noise levels are assumptions based on
vendors' figures; no real radar was measured. `ti` is a TI AWR1843 (range 1.5 cm, azimuth 0.55 deg, elevation 1 deg),
`ti_aisle` the same in a narrow aisle (2 cm, 0.8, 2), `ti_fine` with interpolated peaks (0.8 cm, 0.2, 0.7), `imaging` an imaging
radar (3 cm, 0.12, 0.25); clicks have 2 px of noise in a 1920 x 1080 picture with a field of view of 75 deg. The field scene
extends from 2 to 20 m, the aisle is 2.4 m wide and 15 m long.

The figure after ± is two standard errors. "Met": the figure reaches the aim. "Undecided": it does not, but by less than two
standard errors, so more trials would be needed. "Missed": it misses the aim significantly; even if nothing is wrong, about
one row in forty is missed by chance.
"""


def page(sections: Sequence[Section]) -> str:
    """Return the page in Markdown."""
    claims = [claim for section in sections for claim in section.claims]
    return "\n".join([_HEAD, _summary(claims), *(_section(one) for one in sections)])


def _summary(claims: Sequence[Claim]) -> str:
    cells = tuple((claim.aim, claim.measured, claim.verdict) for claim in claims)
    return "## Aims\n\n" + _table(Part("", ("aim", "measured", ""), cells))


def _section(section: Section) -> str:
    tables = [_table(part) for part in section.parts if part.cells] or ["Not run.\n"]
    return "\n".join([f"## {section.title}\n", section.text + "\n", *tables])


def _table(part: Part) -> str:
    lines = [f"### {part.title}\n"] if part.title else []
    lines.append("| " + " | ".join(part.head) + " |")
    lines.append("|---" * len(part.head) + "|")
    lines += ["| " + " | ".join(row) + " |" for row in part.cells]
    return "\n".join(lines) + "\n"
