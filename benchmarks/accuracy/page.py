"""Write docs/accuracy.md from kept figures."""

from collections.abc import Sequence
from dataclasses import replace

from benchmarks.accuracy.rows import Claim, Part, Section

__all__ = ["page"]

_HEAD = """# Accuracy

Written by `COMMAND`; do not edit. Everything except the real pairs is simulated, with a fixed seed per trial: the
figures do not depend on the number of processors, and every method gets the same draws. `make bench-accuracy SEED=fresh` draws
from the hash of the present commit instead, so that nobody has seen the draws before; where it was run, its figures stand next
to those of the fixed seeds.

There are two families. Default: the errors that real radars, lenses and clicks have are drawn from the priors that the options
state, and the estimator is given the default options. Ideal: radar, lens and clicks have nothing but independent noise, and the
estimator is told so; the Cramer-Rao bound assumes the same.

Noise levels are assumptions based on
vendors' figures; no real radar was measured. `ti` is a TI AWR1843 (range 1.5 cm, azimuth 0.55 deg, elevation 1 deg),
`ti_aisle` the same in a narrow aisle (2 cm, 0.8, 2), `ti_fine` with interpolated peaks (0.8 cm, 0.2, 0.7), `imaging` an imaging
radar (3 cm, 0.12, 0.25); clicks have 2 px of noise in a 1920 x 1080 picture with a field of view of 75 deg. The field scene
extends from 2 to 20 m, the aisle is 2.4 m wide and 15 m long.

The figure after ± is two standard errors. "Met": the figure reaches the aim. "Undecided": it does not, but by less than two
standard errors, so more trials would be needed. "Missed": it misses the aim significantly; even if nothing is wrong, about
one row in forty is missed by chance.
"""

_USUAL = "make bench-accuracy"


def page(
    sections: Sequence[Section],
    fresh: Sequence[Section] = (),
    *,
    commit: str = "",
    command: str = _USUAL,
) -> str:
    """Return the page in Markdown.

    Args:
        sections: of the fixed seeds.
        fresh: the same sections of the fresh seeds; none if they were not run.
        commit: whose hash gave the fresh seeds.
        command: what wrote the page.
    """
    others = fresh or [None] * len(sections)
    shown = [_section(one, other) for one, other in zip(sections, others, strict=True)]
    head = _HEAD.replace("COMMAND", command)
    return "\n".join([head, _summary(_claims(sections), _claims(fresh), commit), *shown])


def _claims(sections: Sequence[Section]) -> list[Claim]:
    return [claim for section in sections for claim in section.claims]


def _summary(claims: Sequence[Claim], fresh: Sequence[Claim], commit: str) -> str:
    cells = tuple((claim.aim, claim.measured, claim.verdict) for claim in claims)
    if not fresh:
        return "## Aims\n\n" + _table(Part("", ("aim", "measured", ""), cells))
    both = tuple((*cell, other.measured, other.verdict) for cell, other in zip(cells, fresh, strict=True))
    head = ("aim", "fixed seeds", "", f"seeds from the hash of {commit[:7]}", "")
    return "## Aims\n\n" + _table(Part("", head, both))


def _section(section: Section, fresh: Section | None) -> str:
    tables = [_table(part) for part in section.parts if part.cells] or ["Not run.\n"]
    lines = [f"## {section.title}\n", section.text + "\n", *tables]
    if fresh is not None and section.side_by_side and any(part.cells for part in fresh.parts):
        lines += [
            _table(replace(part, title=" ".join(filter(None, ("Fresh seeds:", part.title))).rstrip(":")))
            for part in fresh.parts
            if part.cells
        ]
    return "\n".join(lines)


def _table(part: Part) -> str:
    lines = [f"### {part.title}\n"] if part.title else []
    lines.append("| " + " | ".join(part.head) + " |")
    lines.append("|---" * len(part.head) + "|")
    lines += ["| " + " | ".join(row) + " |" for row in part.cells]
    return "\n".join(lines) + "\n"
