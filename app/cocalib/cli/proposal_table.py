"""Proposals as a table for the terminal."""

from collections.abc import Sequence

import numpy as np

from calib_core.association.placements import Placement
from calib_core.measurements import NS_PER_S, TimeNs
from calib_core.proposing import DwellView, Proposals
from calib_core.proposing.proposals import named_proposals
from calib_core.recordings import table_lines
from calib_core.words.warnings import probability_text

_HEAD = ("id", "time [s]", "range [m]", "column [px]", "row [px]", "sigma [px]", "confidence", "reason")


def proposal_lines(
    proposals: Proposals, views: Sequence[DwellView], origin: TimeNs, confirmed: Sequence[str] = ()
) -> list[str]:
    """Return the proposals, the most confident first, and what could not be proposed.

    Args:
        proposals: of these views.
        views: of all placements of a recording.
        origin: stamp of its first frame; times count from there.
        confirmed: ids of the clicks that were given.
    """
    rows = [
        (
            name,
            f"{_seconds(one.image_time, origin):.1f}",
            f"{_range_m(one.placement):.1f}",
            f"{one.pixel_px[0]:.1f}",
            f"{one.pixel_px[1]:.1f}",
            f"{one.sigma_px:.1f}",
            probability_text(one.confidence),
            one.reason,
        )
        for name, one in named_proposals(proposals, views, confirmed)
    ]
    return [
        *(table_lines([_HEAD, *rows], right=range(1, len(_HEAD) - 1)) if rows else []),
        *unproposed_lines(proposals, origin),
        _summary(proposals, confirmed),
    ]


def unproposed_lines(proposals: Proposals, origin: TimeNs) -> list[str]:
    """Return a line for each placement that could not be proposed: when, where and why not."""
    return [
        f"not proposed: the placement from {_seconds(placement.start, origin):.1f} to {_seconds(placement.end, origin):.1f} s, "
        f"{_range_m(placement):.1f} m away: {reason}"
        for placement, reason in proposals.unproposed
    ]


def _summary(proposals: Proposals, confirmed: Sequence[str]) -> str:
    """Say how many there are, and how far images and radar agree."""
    count = len(proposals.ranked)
    said = f"{count} {'proposal' if count == 1 else 'proposals'}, nobody has confirmed {'it' if count == 1 else 'them'} yet"
    if not count:
        said = "no proposals"
    if confirmed:
        said += f"; {len(confirmed)} {'click was' if len(confirmed) == 1 else 'clicks were'} given as confirmed"
    if proposals.agreement is not None:
        agreement, rival = (100.0 * share for share in (proposals.agreement.share, proposals.agreement.rival_share))
        said += f"; images and radar agree on one mounting by {agreement:.0f} %, on another by {rival:.0f} %"
    return said


def _seconds(time: TimeNs, origin: TimeNs) -> float:
    return (int(time) - int(origin)) / NS_PER_S


def _range_m(placement: Placement) -> float:
    return float(np.linalg.norm(placement.position_radar_m))
