"""Write docs/paper-experiments.md."""

from collections.abc import Sequence

import numpy as np

from benchmarks.paper.fit import AZIMUTHS_DEG, ELEVATIONS_DEG, Fitted
from benchmarks.paper.limits import PAPER, Paper, figures_of, median_of, missed, order_kept, verdict_of
from benchmarks.paper.measured import AccRow, Measured
from benchmarks.paper.rows import Figures, Seed
from benchmarks.paper.settings import BOARD_CORNERS, FIT_SEEDS, Settings
from benchmarks.paper.text import TEXT

__all__ = ["page"]

_ENORMOUS = 1e6
_NOT_AVAILABLE = "not available to us"
_RANGE = ("PPM+D1", "PPM+D3", "PMM+D1", "R_PPM+T_m+D1", "R_I+T_c+D1")


def page(measured: Measured, settings: Settings, places: Sequence[Fitted], *, command: str) -> str:
    """Return the page in Markdown.

    Args:
        measured: the figures.
        settings: that they were made with.
        places: of the fit, the best first.
        command: that writes the page.
    """
    seeds = measured.seeds
    others = [name for name in seeds[0].rows if name not in PAPER]
    return TEXT.format(
        date=measured.date,
        command=command,
        count=len(seeds),
        table="\n".join(_row(name, seeds) for name in PAPER),
        order=order_kept(seeds),
        missed=missed(seeds),
        further="\n".join(_further_row(name, seeds) for name in others),
        fitted=_fit_table(places),
        best=_best(places),
        highest_ratio=max(one.ratio_d2 for one in places),
        fit_seeds=f"{FIT_SEEDS[0]} to {FIT_SEEDS[-1]}",
        azimuths=", ".join(f"{one:g}" for one in AZIMUTHS_DEG),
        elevations=", ".join(f"{one:g}" for one in ELEVATIONS_DEG),
        settings=settings,
        board_corners=BOARD_CORNERS,
        range_names=" | ".join(_RANGE),
        range_dashes="---|" * (len(_RANGE) + 1),
        ranges="\n".join(_range_row(what, some) for what, some in measured.ranges),
        range_count=len(measured.ranges[0][1]),
        acc_count=len(measured.accs[0].kept),
        acc="\n".join(_acc_row(row) for row in measured.accs),
        height_px=settings.width_px * 9 // 16,
        not_available=_NOT_AVAILABLE,
    )


def _row(name: str, seeds: Sequence[Seed]) -> str:
    figures = figures_of(name, seeds)
    aed, cdsd = median_of(figures, "aed_px"), median_of(figures, "cdsd_px")
    ours = [_spread(figures, "aed_px"), _spread(figures, "cdsd_px"), f"{aed / cdsd:.2f}"]
    return f"| {name} | {_stated(PAPER[name])} | {' | '.join(ours)} | {verdict_of(name, figures)} |"


def _stated(stated: Paper) -> str:
    if stated.ratio is not None:
        return f"AED / CDSD {stated.ratio:.2f}; the two {_NOT_AVAILABLE}"
    if stated.aed_px is None:
        return _NOT_AVAILABLE
    cdsd = _NOT_AVAILABLE if stated.cdsd_px is None else f"{stated.cdsd_px:.2f}"
    return f"{stated.aed_px:.2f} / {cdsd}"


def _further_row(name: str, seeds: Sequence[Seed]) -> str:
    figures = figures_of(name, seeds)
    outside = f"{100 * median_of(figures, 'outside'):.0f} %"
    cells = [_spread(figures, "aed_px"), _spread(figures, "cdsd_px"), outside]
    return f"| {name} | {' | '.join(cells)} |"


def _range_row(what: str, seeds: Sequence[Seed]) -> str:
    medians = [median_of(figures_of(name, seeds), "aed_px") for name in _RANGE]
    return f"| {what} | {' | '.join(f'{one:.1f}' if np.isfinite(one) else '-' for one in medians)} |"


def _acc_row(row: AccRow) -> str:
    cells = (_percent(values) for values in (row.kept, row.dropped, row.labelled, row.turned))
    return f"| {row.what} | {row.paper} | {' | '.join(cells)} |"


def _fit_table(places: Sequence[Fitted]) -> str:
    names = "azimuth [deg] | elevation [deg] | AED of D1 [px] | CDSD of D1 [px] | AED / CDSD of D2 | mismatch"
    rows = [
        f"| {one.constant_azimuth_deg:g} | {one.constant_elevation_deg:g} | {one.aed_d1_px:.2f} | "
        f"{one.cdsd_d1_px:.2f} | {one.ratio_d2:.2f} | {one.mismatch:.3f} |"
        for one in places
    ]
    return "\n".join([f"| {names} |\n{'|---' * 6}|", *rows])


def _best(places: Sequence[Fitted]) -> str:
    """Name the best place, and say where in the grid it is."""
    best = places[0]
    inside = (
        AZIMUTHS_DEG[0] < best.constant_azimuth_deg < AZIMUTHS_DEG[-1]
        and ELEVATIONS_DEG[0] < best.constant_elevation_deg < ELEVATIONS_DEG[-1]
    )
    place = f"azimuth {best.constant_azimuth_deg:g} deg, elevation {best.constant_elevation_deg:g} deg"
    return f"{place}, which is {'inside' if inside else 'at the edge of'} the grid"


def _spread(figures: Sequence[Figures], name: str) -> str:
    values = np.array([getattr(one, name) for one in figures])
    values = values[np.isfinite(values)]
    if not len(values):
        return "-"
    middle, low, high = (
        f"{one:.1f}" if one < _ENORMOUS else f"above {_ENORMOUS:.0f}"
        for one in (np.median(values), values.min(), values.max())
    )
    return f"{middle} ({low} to {high})"


def _percent(values: Sequence[float]) -> str:
    good = [100.0 * one for one in values if np.isfinite(one)]
    return f"{np.median(good):.0f} % ({min(good):.0f} to {max(good):.0f})" if good else "-"
