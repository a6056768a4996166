"""The page docs/radar-formats.md, generated from the registry of radar layouts.

python -m calib_core.recordings.radar.registry_table docs/radar-formats.md
"""

import sys
from pathlib import Path

from calib_core.recordings.plain_files.radar_csv import CSV_EXAMPLE, csv_columns
from calib_core.recordings.radar.column_plans import plan_for
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind

__all__ = ["main", "radar_formats"]

_KINDS: dict[MessageKind, str] = {
    "cloud": "Clouds: sensor_msgs/PointCloud2",
    "channels": "Clouds: sensor_msgs/PointCloud",
    "list": "A header and one list per message",
    "arrays": "Arrays side by side",
    "point": "One return per message",
}
_INTRODUCTION = """\
# Radar formats

This page is generated from the registry that the decoder uses:
`python -m calib_core.recordings.radar.registry_table docs/radar-formats.md`. Each row is tested with messages built from the
definition that the drivers publish (`tests/unit/recordings/radar/radar_samples.py`).

A layout is recognised by its **field names** as declared in the recording, never by the name of the type or its package. The
fields may have any order, offset, alignment, number type and byte order. If several layouts match, the one with the most fields
is used. A message that matches none is read by [what it says about itself](#messages-that-are-in-no-table). `cocalib info`
shows which layout was recognised and which field each value is read from.

All positions are converted to metres in the radar frame of [conventions](conventions.md): x forward, y left, z up. Speeds are
in m/s, positive moving away. If a message states its own noise, that noise is kept with each return.

## Messages that are in no table

Any message with a position and a speed or an amplitude is read: a list of structs at any depth, a fixed list whose length
another field counts, arrays side by side, one return per message, a cloud with unusual field names. What each field is follows
from

* its **name**, without prefixes (`f_`, `s_`, `u16`, `det_`): `fRange`, `posX`, `x_pos`, `DistLong`, `vRad`, `RCS_dBsm`. Names
  with `std`, `min`, `max`, `bin`, `id` and the like are not the quantity itself;
* the **unit** in its name (`range_m`, `Azimuth_deg`) or in the comment of its definition (`# [m]`, `# 0.01 deg`), where
  comments may also state directions (`# positive to the left`, `# x right, y forward, z up`);
* its **values**: positions in cm or mm would reach kilometres in m, angles above 6.28 are not radians, no radar sees only
  within 1.5 degrees, an axis that is never negative points forward;
* its **agreement** with others: an azimuth that matches x and y shows which axis is forward, and a range with a unit gives x, y
  and z theirs.

PointCloud2 and the positions of geometry_msgs are in metres, x forward, y left, z up, as ROS defines (REP 103), unless values
contradict it. `cocalib info` lists for each quantity the field, its unit, the direction in which it grows, and how this is
known.

What nothing states is an **assumption**: the side to which an azimuth grows, the unit of a speed, left or right of a lateral
axis, which of two angles is the azimuth, several sensors in one list. It is a warning (`assumed`) and part of the calibration's
provenance, and `cocalib solve` waits until it is confirmed with `--confirm-assumptions` or stated. On the page, a button
confirms it.

If several lists of a message hold returns, detections are preferred to tracked objects, and `cocalib info` names the others. If
no field is recognised, it names the fields. Messages that hold little more than bytes are raw sensor packets, which only the
driver can decode.

## Stating what a column is

`--map QUANTITY=COLUMN:UNIT` replaces what was recognised and settles what would be assumed; it may be repeated. Columns are
named as the recording spells them, nested ones dotted, relative to the list or from the message on. A minus turns the sign.

```
cocalib open  RECORDING --map x=posX:m --map y=-posY:m           posY grows to the right
cocalib solve RECORDING --map range=u16Range:cm --map azimuth=-theta:deg --map doppler=vel:kmh ...
```

Mapped x, y and z point forward, left and up, mapped angles grow to the left and upwards. The session remembers the map, and the
calibration holds it (`provenance.column_map`).

## Messages with other axes, signs or units

Use `--radar-axes` to state where the message's x, y and z point, in this order:

```
cocalib info  RECORDING --radar-axes forward,right,up            y to the right, or azimuth positive to the right
cocalib open  RECORDING --radar-axes right,forward,up            x to the right, y forward
cocalib solve RECORDING --radar-axes degrees ...                 the angles are in degrees
cocalib solve RECORDING --radar-axes forward,left,down,radians ...
```

Polar messages are first converted to x, y, z as the table says, then the option is applied. It is stored in the calibration
(`provenance.radar_axes`). A session opened with different axes than before reports this and solves its clicks again.

## Consistency checks

These checks run on a sample of the messages; `cocalib info` and the page show the results as warnings:

| code | meaning |
|---|---|
| `radar-range-contradicts` | the message's range differs from the length of its x, y, z |
| `radar-azimuth-mirrored` | the message's azimuth has the sign opposite to its y |
| `radar-azimuth-contradicts` | azimuth and x, y disagree in every unit and sign |
| `radar-elevation-zero` | the elevation is always 0, but the positions have heights |
| `radar-angle-unit` | the angles are implausible in the unit they are read in |
| `assumed` | neither the message nor a document of its layout states a unit, a sign or a meaning; says what is assumed |
| `flat-radar` | every return has the same height: the radar measures no elevation |

"""


_FILES = """\
## Files without ROS

Folders and files can be opened with or without ROS recordings: `cocalib open RADAR_FRONT/ CAM_FRONT/`, or the
folder that contains them.

| what | read as |
|---|---|
| folder of `.pcd` (version 0.7, binary or ascii), such as nuScenes | radar, one scan per file; recognised like a PointCloud2 |
| folder of `.bin` | View-of-Delft radar, one scan per file |
| `.csv` | radar; the first line names columns and units: `{example}` |
| folder of pictures | camera |
| video file, with `--video-start` | camera; most videos do not store the original frame times: use the recording if possible |

The time of a file comes from a CSV in or next to its folder (`file,time_ns`), or from its name: the last number of 19
digits (ns), 16 (us), 13 (ms) or 10 (s, with or without a fraction) that is a date after 2001. Files that are only numbered
are assumed to be 0.1 s apart, and a warning says so.

### Columns of a radar CSV

Columns are separated by commas, semicolons or tabs. The unit follows the name, as in `x_m` or `x [m]`. Rows with the same time
form one scan. An unknown or missing unit is an error; columns with other names are ignored, and `cocalib info` lists them.
Axes and signs are those of the radar frame.

| column | units |
|---|---|
{columns}
"""


def radar_formats() -> str:
    """Return the page."""
    parts = [_INTRODUCTION.rstrip("\n"), ""]
    for kind, title in _KINDS.items():
        parts += [f"## {title}", "", *_table([decoder for decoder in DECODERS if decoder.kind == kind]), ""]
    parts += [_FILES.format(example=CSV_EXAMPLE, columns="\n".join(csv_columns())).rstrip("\n"), "", "## Notes", ""]
    parts += [
        f"* **{d.name}**: {'; '.join(filter(None, (d.note, d.assumed)))}." for d in DECODERS if d.note or d.assumed
    ]
    return "\n".join(parts) + "\n"


def _table(decoders: list[Decoder]) -> list[str]:
    rows = [
        "| layout | used by | position [m; angles as listed] | axes | angles | speed [m/s] | amplitude | noise |",
        "|" + "---|" * 8,
    ]
    rows += ["| " + " | ".join(_cells(decoder)) + " |" for decoder in decoders]
    return [*rows, "", "Recognised by:", "", *(f"* {d.name}: `{' '.join(d.fields)}`" for d in decoders)]


def _cells(decoder: Decoder) -> tuple[str, ...]:
    plan = plan_for(decoder.kind, decoder.fields)
    assert plan is not None, f"{decoder.name} has no position"
    speed = ", ".join(filter(None, (plan.doppler, decoder.speed)))
    amplitude = ", ".join(filter(None, (plan.amplitude, decoder.amplitude)))
    return (
        decoder.name, decoder.source, ", ".join(plan.position), decoder.axes,
        decoder.angles, speed, amplitude, decoder.noise,
    )  # fmt: skip


def main(path: str) -> None:
    """Write the page to a file."""
    Path(path).write_text(radar_formats(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
