"""Write the tables of docs/radar-formats.md from the registry of radar layouts: `python docs/make_radar_formats.py`."""

import re
from collections.abc import Iterable
from pathlib import Path

from calib_core.recordings.field_words import SPELLINGS, TABLE_ANGLES, units_for
from calib_core.recordings.plain_files.tables.times import TABLE_EXAMPLE, TIME_SPELLINGS
from calib_core.recordings.radar.column_guess import plan_names
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind
from calib_core.recordings.time.written_times import DATE_SPELLINGS

PAGE = Path(__file__).parent / "radar-formats.md"
_SHOWN_SPELLINGS = 18
_KINDS: dict[MessageKind, str] = {
    "cloud": "Clouds: sensor_msgs/PointCloud2",
    "channels": "Clouds: sensor_msgs/PointCloud",
    "list": "A header and one list per message",
    "arrays": "Arrays side by side",
    "point": "One return per message",
}


def with_tables(page: str) -> str:
    """Return the page with the layouts, dates and columns as the registry and the readers have them."""
    for kind, title in _KINDS.items():
        rows = _table([decoder for decoder in DECODERS if decoder.kind == kind])
        page = _replaced(page, f"## {title}\n\n", r"(?:(?!## ).*\n)*", [*rows, ""])
    page = _replaced(page, "These are one moment:\n\n", r"(?:\*.*\n)*", [f"* `{date}`" for date in DATE_SPELLINGS])
    page = _replaced(page, "| quantity | spellings | units |\n|---|---|---|\n", r"(?:\|.*\n)*", _columns())
    return _replaced(page, "of a CSV names columns and units: ", r".*\n", [f"`{TABLE_EXAMPLE}` |"])


def _replaced(page: str, before: str, old: str, lines: Iterable[str]) -> str:
    """Return the page with other lines after a text that it holds once."""
    assert page.count(before) == 1, before
    new = "".join(f"{line}\n" for line in lines)
    return re.sub(re.escape(before) + old, lambda _: before + new, page)


def _columns() -> tuple[str, ...]:
    """Return the rows of quantities, spellings and units of tables."""
    known: dict[str, list[str]] = {}
    for one in (*SPELLINGS, *TABLE_ANGLES):
        known.setdefault({"longitudinal": "x", "lateral": "y", "radial": "doppler"}.get(one.kind, one.kind), []).append(
            one.words
        )
    sigma = {f"sigma_{q}": [f"sigma {q}", f"{q} std", f"{q} accuracy"] for q in ("range", "azimuth", "elevation")}
    order = ("x", "y", "z", "range", "azimuth", "elevation", "doppler", "vx", "vy", "vz", "snr", "rcs", "power", "amplitude",
             "intensity")  # fmt: skip
    rows = []
    for quantity, spellings in {**TIME_SPELLINGS, **{name: known[name] for name in order}, **sigma}.items():
        units = {"time": "ns, us, ms, s, or dates"}.get(quantity, "")
        if not units and quantity not in TIME_SPELLINGS:
            units = ", ".join(unit.flag for unit in units_for(quantity))
        names = ", ".join(f"`{spelling}`" for spelling in spellings[:_SHOWN_SPELLINGS])
        rows.append(f"| {quantity} | {names} | {units} |")
    return tuple(rows)


def _table(decoders: list[Decoder]) -> list[str]:
    rows = [
        "| layout | used by | fields | position | angles | speed | amplitude | notes |",
        "|" + "---|" * 8,
    ]
    return [*rows, *("| " + " | ".join(_cells(decoder)) + " |" for decoder in decoders)]


def _cells(decoder: Decoder) -> tuple[str, ...]:
    plan = plan_names(decoder.kind, decoder.fields)
    assert plan is not None, f"{decoder.name} has no position"
    speed = ", ".join(filter(None, (plan.doppler, decoder.speed.removeprefix("positive moving away"))))
    amplitude = ", ".join(filter(None, (plan.amplitude, decoder.amplitude)))
    noise = "" if decoder.noise == "none" else f"states its noise: {decoder.noise}"
    return (
        decoder.name, decoder.source, f"`{' '.join(decoder.fields)}`", ", ".join(plan.position),
        decoder.angles.replace(", since the message has positions", ""), speed, amplitude,
        "; ".join(filter(None, (decoder.note, decoder.assumed, noise))),
    )  # fmt: skip


if __name__ == "__main__":
    PAGE.write_text(with_tables(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
