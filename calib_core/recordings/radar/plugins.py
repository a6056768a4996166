"""Radar layouts of other installed packages (entry points cocalib.radar_layouts), beside those of the registry."""

from collections.abc import Iterable
from functools import cache
from typing import get_args

from calib_core.plugins import load_plugins, warn_left_out
from calib_core.recordings.radar.columns import plan_columns
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind

__all__ = ["GROUP", "all_decoders"]

GROUP = "cocalib.radar_layouts"


@cache
def all_decoders() -> tuple[Decoder, ...]:
    """Return every layout: ours, then those that installed packages add; loaded once, when somebody first asks."""
    known = list(DECODERS)
    for plugin in load_plugins(GROUP, Decoder):
        fault = _fault(plugin.value, known)
        if fault:
            warn_left_out(plugin.distribution, f"the radar layout {plugin.value.name!r} {fault}")
        else:
            known.append(plugin.value)
    return tuple(known)


def _fault(added: Decoder, known: Iterable[Decoder]) -> str:
    """Say why a layout cannot be taken, "" where it can."""
    if added.kind not in get_args(MessageKind):
        return f"is of the kind {added.kind!r}; there are {', '.join(get_args(MessageKind))}"
    if not added.polar and plan_columns(added.fields) is None:
        return "has no position: neither x, y, z nor a range and an azimuth among its fields, and no polar"
    for one in known:
        if one.name == added.name:
            return "has the name of another; its own needs another name"
        if one.kind == added.kind and _folded(one.fields) == _folded(added.fields):
            return f"is recognised by the same fields as {one.name!r}; one more field would tell them apart"
    return ""


def _folded(names: Iterable[str]) -> set[str]:
    return {name.lower() for name in names}
