"""Exclusive returns: two clicks of one scene mark two reflectors, so they cannot both be the same radar return.

Clicks of one placement are one pair before this (`placement_groups`); what remains in one scene are different pixels. A scene
lasts as long as its reflectors stand: a return that the radar shows at one place in the windows of two clicks is one return.
"""

from collections.abc import Sequence

import numpy as np

from calib_core.arrays import Flags, Indices, Values
from calib_core.association.clustering import CLUSTER_SCALE
from calib_core.measurements import NS_PER_S, Pair
from calib_core.radar import direction_cosines

_SAME_RETURN = 1.0  # steps between the positions of one return in two windows that overlap
_SAME_STANDING = 0.5  # the same in windows that do not overlap
_SCENE_WINDOWS = 4.0  # windows between two clicks of one scene
_SHARED_COST = 1e9  # of a return taken twice, where a pair has nothing else
_MOST_EXACT = 4  # pairs in one scene; of more, the cheapest choose first


def shared_returns(pairs: Sequence[Pair], *, window_s: float) -> Indices:
    """Label the candidates of all pairs (m,): equal labels are one return in one scene; -1 is shared with no other pair.

    The alternatives of a shared return are that return too.

    Args:
        pairs: one per placement; candidate rows follow each other in this order.
        window_s: images closer in time than this show the same moment to the radar [s].
    """
    owner = np.repeat(np.arange(len(pairs)), [len(pair.candidates) for pair in pairs])
    rows, others = _common(pairs, owner, window_s)
    if not len(rows):
        return np.full(len(owner), -1, dtype=np.int64)
    of = np.array([candidate.alternative_of for pair in pairs for candidate in pair.candidates], dtype=np.int64)
    alternatives = np.flatnonzero(of >= 0)
    _, firsts, sets = np.unique(
        np.stack([owner[alternatives], of[alternatives]], axis=1), axis=0, return_index=True, return_inverse=True
    )
    linked = np.concatenate([rows, alternatives]), np.concatenate([others, alternatives[firsts[sets.reshape(-1)]]])
    roots = _components(len(owner), *linked)
    return np.where(np.isin(roots, roots[rows]), roots, -1)


def _common(pairs: Sequence[Pair], owner: Indices, window_s: float) -> tuple[Indices, Indices]:
    """Return the candidate rows (k,) and (k,) that two pairs of one scene have in common: each other's nearest."""
    times = np.array([pair.image_time or 0 for pair in pairs], dtype=np.int64)[owner]
    timed = np.flatnonzero(np.array([pair.image_time is not None for pair in pairs], dtype=np.bool_)[owner])
    places = direction_cosines(
        np.array([candidate.position_radar_m for pair in pairs for candidate in pair.candidates]).reshape(-1, 3)
    )
    steps = places / CLUSTER_SCALE
    order = timed[np.argsort(steps[timed, 0], kind="stable")]
    found = [np.zeros((0, 2), dtype=np.int64)]
    for step in range(1, len(order)):
        low, high = order[:-step], order[step:]
        near = steps[high, 0] - steps[low, 0] <= _SAME_RETURN
        if not near.any():
            break
        apart_s = np.abs(times[high] - times[low]) / NS_PER_S
        near &= (owner[low] != owner[high]) & (apart_s <= _SCENE_WINDOWS * window_s)
        found.append(np.stack([low[near], high[near]], axis=1))
    rows, others = np.concatenate(found).T
    away = ((steps[rows] - steps[others]) ** 2).sum(axis=1)
    within = np.where(np.abs(times[rows] - times[others]) / NS_PER_S <= window_s, _SAME_RETURN, _SAME_STANDING)
    rows, others, away = (column[away <= within**2] for column in (rows, others, away))
    mutual = _nearest(rows, owner[others], away) & _nearest(others, owner[rows], away)
    return rows[mutual], others[mutual]


def _nearest(rows: Indices, owners: Indices, away: Values) -> Flags:
    """Return which entries (k,) are the nearest of their row in the pair that owns the other one."""
    order = np.lexsort((away, owners, rows))
    first = np.ones(len(rows), dtype=np.bool_)
    first[1:] = (np.diff(rows[order]) != 0) | (np.diff(owners[order]) != 0)
    nearest = np.zeros(len(rows), dtype=np.bool_)
    nearest[order[first]] = True
    return nearest


def _components(count: int, rows: Indices, others: Indices) -> Indices:
    """Return the smallest row (count,) that each is linked to, directly or through others."""
    roots = np.arange(count)
    while True:
        lower = roots.copy()
        np.minimum.at(lower, rows, roots[others])
        np.minimum.at(lower, others, roots[rows])
        lower = lower[lower]
        if (lower == roots).all():
            return roots
        roots = lower


def taken_twice(labels: Indices) -> Flags:
    """Return in which rows of labels (..., n), one per pair, a return is taken twice."""
    ordered = np.sort(labels, axis=-1)
    return np.asarray(((ordered[..., 1:] == ordered[..., :-1]) & (ordered[..., 1:] >= 0)).any(axis=-1))


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
    for members in _contested_groups(owner, labels, twice):
        options = [order[first[i] : first[i + 1]].tolist() for i in members]
        rows[members] = _cheapest(options, cost, labels)
    return rows


def _contested_groups(owner: Indices, labels: Indices, contested: Indices) -> list[list[int]]:
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
