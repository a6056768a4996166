"""Write docs/real.md and the table of figures from what was judged."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, astuple

import numpy as np

from benchmarks.real.judging import METHODS, TURNS_DEG, Judged, PoseFigures
from benchmarks.real.sets import RealSet

Outcomes = Mapping[RealSet, Judged | str]
"""What was judged, or why it was not."""

_HEAD = """# Real recordings

Written by `python -m benchmarks.real --data FOLDER --write`; do not edit.

Recordings and pairs that others published, solved as a user would, and compared with the extrinsics that they published. Nothing
of them is shipped. FOLDER holds their checkouts ([below](#checkouts)); `--only NAME` runs one row, and a set that is not there is
said in its row. `python -m benchmarks.real --list` needs no data. A further set is a row in `benchmarks/real/sets.toml`.

Two sets have a radar and a published pose, both of one rig and from one reference with a known bias. The sets of lidars test the
solver and not a radar's noise. Many rows share a rig, so the rows are too few and too alike for a rate.

- **Ours** is the default method with default options, but where [a row](#the-sets) names the noise. **Algorithm 1** is the
  paper's (`--method paper`). **OpenCV** is RANSAC with SQPnP (8 px), then Levenberg-Marquardt on its inliers, from the radar
  positions that ours chose.
- Each has its angle from the published rotation, the distance of the two camera positions, the mean reprojection error of all
  pairs, those that the method sets aside included, and the median distance to pairs that are left out: a tenth at a time is
  predicted by the pose of the others. The mean and the median do not compare with each other. Least squares on all pairs makes
  the mean small; it does not judge the pose.
- **Published**: the mean reprojection error of the published pose.
- **Inside**: whether the published pose is in our 95 % ellipsoid, and how far out it is in the ellipsoid's radius. It is a
  measurement with [errors of its own](#the-sets), so a right estimate may have it outside. The ellipsoid holds shared errors of
  a radar's size, so with a lidar a small distance says that it is wide, not that the pose is good.
- **Verdict**: its level, or the code of the refusal, and the codes of the [warnings](warnings.md).
"""
_NEARER = """In the rows with a published pose, ours has a smaller figure than

{counts}

Below half, ours is mostly farther from the published poses. These are fits of the same points, some by OpenCV, and no truth.
Ours also estimates scales of the angles and a bias of the range, which a lidar's points hardly need; whether that is the reason
is not measured.
"""
_QUANTITIES = {"rotation_deg": "rotation", "position_cm": "position", "left_out_px": "the distance left out"}
_ACC = """## Returns in boxes

[Acc](evaluation.md) of the published pose, and of the same pose turned: the mean of pitch and yaw, to both sides.
"""
_SETS = """## The sets

The license is what the repository states; where it states none, only these figures are taken from it. Figures in full:
`benchmarks/real/results.csv`.
"""


def page(outcomes: Outcomes) -> str:
    """Return the page."""
    posed, shares = [], []
    for row, judged in outcomes.items():
        if isinstance(judged, Judged) and judged.acc:
            shares.append((row.name, str(judged.returns), *(f"{100.0 * share:.1f} %" for share in judged.acc)))
        else:
            posed.append(_pose_cells(row, judged))
    turns = ("as published", *(f"{degrees:g} deg" for degrees in TURNS_DEG[1:]))
    parts = [
        *(_HEAD, _table(("set", "pairs", *METHODS, "published", "inside", "verdict and warnings"), posed)),
        *_nearer(outcomes),
        *(_ACC, _table(("set", "returns", *turns), shares)),
        *(_SETS, _reference_table(outcomes)),
        *("### Checkouts\n", "```", *dict.fromkeys(row.clone for row in outcomes), "```\n"),
    ]
    return "\n".join(parts)


def set_table(rows: Sequence[RealSet]) -> str:
    """Return where each set is, and what is read."""
    head = ("set", "what", "where", "license", "reads", "sha256")
    cells = (
        (row.name, row.what, f"{row.repository}@{row.commit[:7]}", row.license, " ".join(row.files), row.sha256[:12])
        for row in rows
    )
    return _table(head, cells)


def _nearer(outcomes: Outcomes) -> list[str]:
    """Count in how many rows with a published pose ours is nearer than each other method; nothing without such rows."""
    judged = [one for one in outcomes.values() if isinstance(one, Judged) and np.isfinite(one.reach)]
    if not judged:
        return []
    counts = []
    for method in METHODS[1:]:
        both = [(one.poses.get(METHODS[0]), one.poses.get(method)) for one in judged]
        solved = [(a, b) for a, b in both if isinstance(a, PoseFigures) and isinstance(b, PoseFigures)]
        told = [
            f"{sum(getattr(a, name) < getattr(b, name) for a, b in solved)} in {words}"
            for name, words in _QUANTITIES.items()
        ]
        counts.append(f"- {method}, of {len(solved)} rows: {', '.join(told)}.")
    return [_NEARER.format(counts="\n".join(counts))]


def _reference_table(rows: Iterable[RealSet]) -> str:
    """Say what is wrong with each reference, once for the sets that share it."""
    names: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        where = f"[{row.repository.partition('/')[0]}](https://github.com/{row.repository})"
        names.setdefault((row.what, where, row.license, row.bias), []).append(row.name)
    head = ("set", "what", "where", "license", "reference")
    return _table(head, ((", ".join(alike), *cells) for cells, alike in names.items()))


def table_csv(outcomes: Outcomes) -> str:
    """Return all figures, one line per set."""
    rows = [{"set": row.name, "commit": row.commit, **_figures(judged)} for row, judged in outcomes.items()]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(dict.fromkeys(name for row in rows for name in row)), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def _figures(judged: Judged | str) -> dict[str, object]:
    if isinstance(judged, str):
        return {"not run": judged}
    solved = {method: pose for method, pose in judged.poses.items() if isinstance(pose, PoseFigures)}
    numbers = {f"{method} {name}": value for method, pose in solved.items() for name, value in asdict(pose).items()}
    numbers |= {"published px": judged.published_px, "reach": judged.reach}
    numbers |= {f"acc {degrees:g} deg": share for degrees, share in zip(TURNS_DEG, judged.acc, strict=False)}
    counts = {
        "pairs": judged.pairs,
        "set aside": judged.set_aside,
        "returns": judged.returns,
        "verdict": judged.verdict,
    }
    written = {name: f"{value:.3f}" for name, value in numbers.items() if np.isfinite(value)}
    return {**counts, "codes": " ".join(judged.codes), **written}


def _pose_cells(row: RealSet, judged: Judged | str) -> tuple[str, ...]:
    if isinstance(judged, str):
        return (row.name, "", judged, "", "", "", "", "")
    aside = f", {judged.set_aside} set aside" if judged.set_aside else ""
    inside = (
        f"{'yes' if judged.reach <= 1.0 else '**no**'}, {judged.reach:.2f}"
        if np.isfinite(judged.reach)
        else "no reference"
    )
    codes = " ".join(f"`{code}`" for code in judged.codes)
    methods = (_pose_cell(judged.poses.get(method, "none")) for method in METHODS)
    published = f"{judged.published_px:.1f} px" if np.isfinite(judged.published_px) else ""
    return (row.name, f"{judged.pairs}{aside}", *methods, published, inside, f"{judged.verdict} {codes}".strip())


def _pose_cell(pose: PoseFigures | str) -> str:
    if isinstance(pose, str):
        return pose
    forms = ("{:.2f} deg", "{:.1f} cm", "{:.1f} px", "{:.1f} left out")
    return ", ".join(form.format(value) for form, value in zip(forms, astuple(pose), strict=True) if np.isfinite(value))


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(cells) + " |" for cells in rows)]) + "\n"
