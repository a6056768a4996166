"""The table of pairs; of many, those with the largest residuals."""

import numpy as np

from cocalib.report.markup import Markup, scrolled, tag
from cocalib.report.residual_rows import ResidualRows
from cocalib.view.wording import plain

_MOST = 30
_WORDS = {"used": "● agrees", "disagrees": "✕ disagrees", "excluded": "□ left out"}
_HEADS = (
    "pair",
    "range m",
    "azimuth deg",
    "elevation deg",
    "click u px",
    "v px",
    "residual u px",
    "v px",
    "length px",
    "leave-one-out px",
    "wrong with p",
    "influence",
    "state",
)


def pair_table(rows: ResidualRows) -> Markup | None:
    """Return the table; None without pairs."""
    if not len(rows):
        return None
    shown = _rows_to_show(rows)
    note = (
        f"{len(shown)} of {len(rows)} clicks: those with the largest residuals; all are in the calibration's file."
        if len(shown) < len(rows)
        else f"All {len(rows)} clicks."
    )
    body = (_row(rows, index) for index in shown)
    return tag(
        "section",
        tag("h2", "Pairs"),
        tag("p", f"{note} Influence: how far the pose moves without the pair, in standard deviations.", class_="note"),
        scrolled(
            "Pairs",
            tag("thead", tag("tr", *(tag("th", head, scope="col") for head in _HEADS))),
            tag("tbody", *body),
            class_="pairs",
        ),
        id="pairs",
    )


def _rows_to_show(rows: ResidualRows) -> list[int]:
    """Return the indices of the rows to show, in the order of the pairs."""
    if len(rows) <= _MOST:
        return list(range(len(rows)))
    lengths = np.where(rows.drawn, rows.lengths_px, np.inf)
    return sorted(np.argsort(-lengths, kind="stable")[:_MOST].tolist())


def _row(rows: ResidualRows, index: int) -> Markup:
    u, v = rows.pixels_px[index].tolist()
    right, down = rows.residuals_px[index].tolist()
    probability = float(rows.outlier_probability[index])
    cells = (
        f"{rows.ranges_m[index]:.2f}",
        f"{rows.azimuths_deg[index]:.1f}",
        f"{rows.elevations_deg[index]:.1f}",
        f"{u:.1f}",
        f"{v:.1f}",
        _signed_number(right),
        _signed_number(down),
        plain(float(rows.lengths_px[index])),
        plain(float(rows.held_out_px[index])),
        "< 0.01" if probability < 0.01 else plain(probability, 2),
        plain(float(rows.influence[index]), 2),
        _WORDS[rows.kinds[index]],
    )
    return tag(
        "tr", tag("th", rows.ids[index], scope="row"), *(tag("td", cell) for cell in cells), class_=rows.kinds[index]
    )


def _signed_number(value: float) -> str:
    return f"{value:+.1f}" if np.isfinite(value) else "–"
