"""The tables of `benchmarks.fleet.prior_value`, as markdown."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, get_args

import numpy as np

from benchmarks.fleet.paired_fleet import Answer, Setting
from benchmarks.fleet.simulated_poses import Spread
from calib_core.verdict import VerdictLevel

if TYPE_CHECKING:
    from benchmarks.fleet.prior_value import FleetFigures, OffKindTrial

__all__ = [
    "ANSWER_HEADINGS",
    "answer_cells",
    "answers_table",
    "gain_table",
    "off_kind_table",
    "prior_table",
    "share_by_fleet",
]

ANSWER_HEADINGS = (
    "solved | sigma | true error over sigma | coverage of the answer | good, usable, weak, contradictory, none | "
    "good or usable: outside the stated error | off-its-kind | fleet-prior-decides"
)
"""Columns of `answer_cells`."""

_Rows = Mapping[Setting, "Sequence[FleetFigures]"]
_STATED: tuple[VerdictLevel, ...] = ("good", "usable")
_LEVELS: tuple[VerdictLevel, ...] = get_args(VerdictLevel)


def prior_table(rows: _Rows) -> Iterator[str]:
    """Say how often the next vehicle's true mounting is in the prior's 95 % ellipsoid."""
    yield "| scatter | next vehicles | coverage of the prior | its sigma | widened by | others left out |"
    yield "|---|---|---|---|---|---|"
    for setting, fleets in rows.items():
        held = [one.held for one in fleets]
        cm, deg, wider = (
            np.median([getattr(one, name) for one in fleets]) for name in ("sigma_cm", "sigma_deg", "widened")
        )
        left_out = sum(one.left_out for one in fleets)
        yield (
            f"| {setting.text} | {sum(map(len, held))} | {share_by_fleet(held)} | {cm:.1f} cm, {deg:.2f} deg | "
            f"{wider:.2f} | {left_out} of {49 * len(fleets)} |"
        )


def answers_table(rows: _Rows) -> Iterator[str]:
    """Say what the prior does to sound vehicles: sigma, true error, coverage, verdicts."""
    yield ""
    yield f"| scatter | placements | {ANSWER_HEADINGS} |"
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for setting, fleets in rows.items():
        for column in ((6, False), (6, True), (20, False), (20, True)):
            by_fleet = [one.answers[column] for one in fleets if column in one.answers]
            answers = [one for row in by_fleet for one in row]
            name = f"{column[0]}{' and the prior' if column[1] else ''}"
            if answers:
                yield f"| {setting.text} | {name} | {answer_cells(answers, by_fleet)} |"


def off_kind_table(rows: "Mapping[Setting, Sequence[OffKindTrial]]") -> Iterator[str]:
    """Say what becomes of vehicles that are off their kind."""
    yield ""
    yield (
        "| scatter | turned by | placements | named | not named: true error of rotation (RMS, largest) | inside 95 % | "
        "far-from-its-kind | fleet-prior-decides | good or usable | of these outside the stated error |"
    )
    yield "|---|---|---|---|---|---|---|---|---|---|"
    for setting, trials in rows.items():
        for turned_deg in sorted({one.turned_deg for one in trials}):
            chosen = [one for one in trials if one.turned_deg == turned_deg]
            for count, answers in ((6, [one.few for one in chosen]), (20, [one.many for one in chosen])):
                yield f"| {setting.text} | {turned_deg:g} deg | {count} | {_off_kinds(answers)} |"


def gain_table(gains: "Sequence[tuple[Spread, dict[int, list[tuple[Answer, Answer]]]]]") -> Iterator[str]:
    """Say by how much the prior changes sigma, by scatter and placements."""
    yield ""
    yield "| scatter | placements | sigma of position, without and with the prior | sigma of rotation | change |"
    yield "|---|---|---|---|---|"
    for spread, found in gains:
        for count, both in found.items():
            solved = [(a, b) for a, b in both if np.isfinite(a.sigma_cm) and np.isfinite(b.sigma_cm)]
            cells, changes = [], []
            for name, unit in (("sigma_cm", "cm"), ("sigma_deg", "deg")):
                without, informed = np.array([[getattr(one, name) for one in row] for row in solved]).T
                cells.append(f"{np.median(without):.2f} -> {np.median(informed):.2f} {unit}")
                changes.append(f"{100.0 * np.median(informed / without - 1.0):+.1f} %")
            text = f"{100 * spread.position_m:g} cm, {spread.rotation_deg:g} deg"
            yield f"| {text} | {count} | {cells[0]} | {cells[1]} | {', '.join(changes)} |"


def share_by_fleet(flags: Sequence[Sequence[bool]]) -> str:
    """Return a share with its standard error, in percent: vehicles of one fleet are not independent of each other."""
    shares = np.array([np.mean(row) for row in flags])
    if len(shares) == 1:
        return f"{100.0 * shares[0]:.1f} %"
    return f"{100.0 * shares.mean():.1f} ± {100.0 * shares.std(ddof=1) / np.sqrt(len(shares)):.1f} %"


def answer_cells(answers: Sequence[Answer], by_fleet: Sequence[Sequence[Answer]]) -> str:
    """Return what came of answers, all and by fleet, as the cells under `ANSWER_HEADINGS`."""
    solved = [one for one in answers if np.isfinite(one.sigma_cm)]
    cm, deg, error_cm, error_deg = np.array(
        [[one.sigma_cm, one.sigma_deg, one.error_cm, one.error_deg] for one in solved]
    ).T
    levels = Counter(one.level for one in answers)
    stated = [one for one in solved if one.level in _STATED]
    inside = [[one.inside for one in row if np.isfinite(one.sigma_cm)] for row in by_fleet]
    return " | ".join(
        (
            f"{len(solved)} of {len(answers)}",
            f"{np.median(cm):.2f} cm, {np.median(deg):.2f} deg",
            f"{_ratio(error_cm, cm):.2f}, {_ratio(error_deg, deg):.2f}",
            share_by_fleet([row for row in inside if row]),
            ", ".join(str(levels[level]) for level in _LEVELS),
            f"{sum(not one.kept for one in stated)} of {len(stated)}",
            str(sum(one.off_kind for one in answers)),
            str(sum("fleet-prior-decides" in one.warnings for one in answers)),
        )
    )


def _off_kinds(answers: Sequence[Answer]) -> str:
    unnamed = [one for one in answers if not one.off_kind and np.isfinite(one.error_deg)]
    errors_deg = np.array([one.error_deg for one in unnamed])
    stated = [one for one in unnamed if one.level in _STATED]
    wrong = f"{np.sqrt((errors_deg**2).mean()):.2f}, {errors_deg.max():.2f} deg" if unnamed else "-"
    return " | ".join(
        (
            f"{sum(one.off_kind for one in answers)} of {len(answers)}",
            wrong,
            f"{sum(one.inside for one in unnamed)} of {len(unnamed)}",
            str(sum("far-from-its-kind" in one.warnings for one in unnamed)),
            str(sum("fleet-prior-decides" in one.warnings for one in unnamed)),
            str(len(stated)),
            str(sum(not one.kept for one in stated)),
        )
    )


def _ratio(errors: np.ndarray, sigmas: np.ndarray) -> float:
    return float(np.sqrt((errors**2).sum() / (sigmas**2).sum()))
