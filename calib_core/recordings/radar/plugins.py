"""Radar layouts of the registry and of other installed packages (entry points cocalib.radar_layouts)."""

from collections.abc import Iterable
from functools import cache
from typing import get_args

from calib_core.plugins import load_plugins, warn_skipped
from calib_core.recordings.radar.columns import plan_columns
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind

GROUP = "cocalib.radar_layouts"


@cache
def all_decoders() -> tuple[Decoder, ...]:
    """Return every layout: ours, then those of installed packages, which are loaded once, on first use."""
    known = list(DECODERS)
    for plugin in load_plugins(GROUP, Decoder):
        fault = _fault(plugin.value, known)
        if fault:
            warn_skipped(plugin.distribution, f"the radar layout {plugin.value.name!r} {fault}")
        else:
            known.append(plugin.value)
    return tuple(known)


def _fault(added: Decoder, known: Iterable[Decoder]) -> str:
    """Return why a layout cannot be used, "" if it can."""
    if added.kind not in get_args(MessageKind):
        return f"has the unknown kind {added.kind!r}; known: {', '.join(get_args(MessageKind))}"
    if not added.polar and plan_columns(added.fields) is None:
        return "has no position: its fields have neither x, y, z nor a range and an azimuth, and it has no polar"
    for one in known:
        if one.name == added.name:
            return "has the same name as another layout"
        if one.kind == added.kind and _folded(one.fields) == _folded(added.fields):
            return f"is recognised by the same fields as {one.name!r}; it needs one more field to differ"
    return ""


def _folded(names: Iterable[str]) -> set[str]:
    return {name.lower() for name in names}
