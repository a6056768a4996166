"""Exclusive returns: two clicks of one moment mark two reflectors, so they cannot both be the same radar return.

Clicks of one placement are one pair before this (`placement_groups`); what remains in one moment are different pixels.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Indices, Values
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.measurements import NS_PER_S, Pair
from calib_core.radar import direction_cosines

_SAME_RETURN = 1.0  # steps between the positions of one return in two windows that overlap
_SHARED_COST = 1e9  # of a return taken twice, where a pair has nothing else
_MOST_EXACT = 4  # pairs in one moment; of more, the cheapest choose first


def shared_returns(pairs: Sequence[Pair], *, window_s: float) -> Indices:
    """Label the candidates of all pairs (m,): equal labels are one return in one moment; -1 is shared with no other pair.

    The alternatives of a shared return are that return too.

    Args:
        pairs: one per placement; candidate rows follow each other in this order.
        window_s: images closer in time than this show the same moment to the radar [s].
    """
    owner = np.repeat(np.arange(len(pairs)), [len(pair.candidates) for pair in pairs])
    labels = np.full(len(owner), -1, dtype=np.int64)
    timed = [i for i, pair in enumerate(pairs) if pair.image_time is not None]
    timed.sort(key=lambda i: (pairs[i].image_time, i))
    first = np.searchsorted(owner, np.arange(len(pairs) + 1))
    for place, i in enumerate(timed):
        for j in timed[place + 1 :]:
            if (pairs[j].image_time or 0) - (pairs[i].image_time or 0) > window_s * NS_PER_S:
                break
            _label_common(labels, pairs, first, i, j)
    _label_alternatives(labels, pairs, owner)
    return labels


def _label_common(labels: Indices, pairs: Sequence[Pair], first: Indices, i: int, j: int) -> None:
    """Give the candidates that two pairs have in common the same label."""
    mine, theirs = (
        direction_cosines(np.array([one.position_radar_m for one in pairs[k].candidates])) / CLUSTER_SCALE
        for k in (i, j)
    )
    squared = ((mine[:, None] - theirs) ** 2).sum(axis=2)
    nearest = squared.argmin(axis=1)
    for a, b in enumerate(nearest.tolist()):
        if squared[a, b] > _SAME_RETURN**2 or int(squared[:, b].argmin()) != a:
            continue
        row, other = int(first[i]) + a, int(first[j]) + b
        known = [int(label) for label in (labels[row], labels[other]) if label >= 0]
        label = min(known) if known else int(labels.max()) + 1
        for old in known:
            labels[labels == old] = label
        labels[[row, other]] = label


def _label_alternatives(labels: Indices, pairs: Sequence[Pair], owner: Indices) -> None:
    """Give the alternatives of each labelled candidate its label."""
    of = np.array([one.alternative_of for pair in pairs for one in pair.candidates], dtype=np.int64)
    for row in np.flatnonzero((labels >= 0) & (of >= 0)).tolist():
        same = (owner == owner[row]) & (of == of[row])
        for old in set(labels[same].tolist()) - {-1, int(labels[row])}:
            labels[labels == old] = labels[row]
        labels[same] = labels[row]


def exclusive_rows(cost: Values, first: Indices, labels: Indices) -> Indices:
    """Choose a candidate row for each pair (n,): the cheapest set in which no return is taken twice.

    Where a pair has no other candidate, a return is taken twice rather than none.

    Args:
        cost: (m,) of each candidate row; lower is better.
        first: (n + 1,) pair i owns the rows first[i] to first[i + 1].
        labels: (m,) of `shared_returns`.
    """
    owner = np.repeat(np.arange(len(first) - 1), np.diff(first))
    order = np.lexsort((np.arange(len(cost)), cost, owner))
    rows = order[first[:-1]]
    taken = labels[rows]
    twice = np.flatnonzero(np.bincount(taken[taken >= 0], minlength=1) > 1)
    if not len(twice):
        return rows
    rows = rows.copy()
    for members in _rivals(owner, labels, twice):
        options = [order[first[i] : first[i + 1]].tolist() for i in members]
        rows[members] = _cheapest(options, cost, labels)
    return rows


def _rivals(owner: Indices, labels: Indices, contested: Indices) -> list[list[int]]:
    """Return the sets of pairs that share returns with each other, directly or through others, and want the same one."""
    groups: list[set[int]] = []
    for label in np.unique(labels[labels >= 0]).tolist():
        members = set(owner[labels == label].tolist())
        joined = [group for group in groups if group & members]
        groups = [group for group in groups if not group & members] + [members.union(*joined)]
    wanted = set(owner[np.isin(labels, contested)].tolist())
    return [sorted(group) for group in groups if group & wanted]


def _cheapest(options: list[list[int]], cost: Values, labels: Indices) -> list[int]:
    """Choose one row from each list, sorted by cost, by branch and bound."""
    if len(options) > _MOST_EXACT:
        return _one_after_another(options, cost, labels)
    least = np.append(np.cumsum([cost[rows[0]] for rows in options[::-1]])[::-1], 0.0).tolist()
    best: tuple[float, list[int]] = (np.inf, [rows[0] for rows in options])
    stack: list[tuple[float, list[int]]] = [(0.0, [])]
    while stack:
        spent, chosen = stack.pop()
        if spent + least[len(chosen)] >= best[0]:
            continue
        if len(chosen) == len(options):
            best = (spent, chosen)
            continue
        taken = {int(labels[row]) for row in chosen} - {-1}
        for row in reversed(options[len(chosen)]):
            again = _SHARED_COST if int(labels[row]) in taken else 0.0
            stack.append((spent + float(cost[row]) + again, [*chosen, row]))
    return best[1]


def _one_after_another(options: list[list[int]], cost: Values, labels: Indices) -> list[int]:
    chosen = [rows[0] for rows in options]
    taken: set[int] = set()
    for i in sorted(range(len(options)), key=lambda i: float(cost[options[i][0]])):
        chosen[i] = next((row for row in options[i] if int(labels[row]) not in taken), options[i][0])
        taken |= {int(labels[chosen[i]])} - {-1}
    return chosen
