"""Choose the columns to use from a message's field names: by the registry, or by the names alone."""

from collections.abc import Iterable
from dataclasses import replace

from calib_core.recordings.radar.columns import ColumnPlan, plan_columns
from calib_core.recordings.radar.plugins import all_decoders
from calib_core.recordings.radar.registry import Decoder, MessageKind

__all__ = ["find_decoder", "plan_for", "plan_like"]


def find_decoder(kind: MessageKind, names: Iterable[str]) -> Decoder | None:
    """Return the layout that requires the most of these fields; None if none matches.

    Args:
        kind: what the fields are fields of.
        names: as the message spells them; nested ones dotted, arrays included.
    """
    have = {name.lower() for name in names}
    fitting = [d for d in all_decoders() if d.kind == kind and have.issuperset(field.lower() for field in d.fields)]
    return max(fitting, key=lambda decoder: len(decoder.fields), default=None)


def plan_for(kind: MessageKind, names: Iterable[str], arrays: Iterable[str] = ()) -> ColumnPlan | None:
    """Plan the columns of a message by the registry or by their names alone; None if there is no position.

    Args:
        kind: what the fields are fields of.
        names: of single numbers, as the message spells them; nested ones dotted.
        arrays: names of fixed arrays of numbers, and of strings.
    """
    names, arrays = tuple(names), tuple(arrays)
    decoder = find_decoder(kind, (*names, *arrays))
    plan = plan_columns(names)
    if decoder is None:
        return plan
    spelt = {name.lower(): name for name in (*arrays, *names)}
    if plan is None:
        plan = ColumnPlan(position=(), polar=True)
    if decoder.polar:
        polar = tuple(spelt[name.lower()] for name in decoder.polar)
        claimed = (polar[0], polar[1], polar[2] if len(polar) == 3 else None)
        plan = replace(plan, position=polar, polar=True, claimed=claimed)
    return replace(
        plan,
        degrees=decoder.degrees or plan.degrees,
        azimuth_sign=float(decoder.azimuth_sign),
        doppler=spelt[decoder.doppler.lower()] if decoder.doppler else plan.doppler,
        velocity=() if decoder.doppler else plan.velocity,
        amplitude=spelt[decoder.amplitude_field.lower()] if decoder.amplitude_field else plan.amplitude,
        amplitude_scale=decoder.amplitude_scale,
        covariance=spelt[decoder.covariance.lower()] if decoder.covariance else None,
        needed=tuple(spelt[name.lower()] for name in decoder.needed),
        decoder=decoder.name,
        assumed=decoder.assumed,
        shared_with_lidars=decoder.shared_with_lidars,
    )


def plan_like(first: ColumnPlan, kind: MessageKind, names: Iterable[str]) -> ColumnPlan | None:
    """Plan a later message of a topic: its own columns, with the user's axes of the first plan."""
    plan = plan_for(kind, names)
    if plan is None:
        return None
    plan = replace(plan, claiming=first.claiming, azimuth_from=first.azimuth_from)
    return plan.read_as(first.axes) if first.axes else plan
