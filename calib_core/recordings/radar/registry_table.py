"""The table of radar layouts in docs/radar-formats.md, written from the registry itself.

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

This page is generated from the registry that reads the messages:
`python -m calib_core.recordings.radar.registry_table docs/radar-formats.md`. Each row is held by a test on bytes built from the
definition its drivers publish (`tests/unit/recordings/radar/radar_samples.py`).

A layout is recognised by its **field names**, as the recording itself declares them, in any order and at any offset,
aligned or not, of any number type and byte order; never by the package's name. Of several that fit, the one with the
most fields is taken. A message that fits none is read by its column names alone, if it has a position: `x y z`, or a
range and an azimuth.
`cocalib info` shows what was recognised and what is read from where.

All positions become metres in the radar frame of [conventions](conventions.md): x forward, y left, z up. Speeds are in m/s,
positive moving away. What a message says about its own noise travels with each return.

## When axes, signs or units are others

One option says where the message's x, y and z point, in this order:

```
cocalib info  RECORDING --radar-axes forward,right,up            y to the right, or azimuth positive to the right
cocalib open  RECORDING --radar-axes right,forward,up            x to the right, y forward
cocalib solve RECORDING --radar-axes degrees ...                 the angles are in degrees
cocalib solve RECORDING --radar-axes forward,left,down,radians ...
```

Polar messages are first turned into x, y, z as the table says, then the option is applied. It is kept in the calibration
(`provenance.radar_axes`); a session that is opened with other axes than before says so, and solves its clicks anew.

## What is compared

From a sample of the messages, and said as warnings by `cocalib info` and on the page:

| code | what was found |
|---|---|
| `radar-range-contradicts` | the message's range is not the length of its x, y, z |
| `radar-azimuth-mirrored` | the message's azimuth has the sign opposite to its y |
| `radar-azimuth-contradicts` | azimuth and x, y agree in no unit and sign |
| `radar-elevation-zero` | the elevation is always 0, yet there are heights |
| `radar-angle-unit` | the angles can hardly be of the unit they are read in |
| `radar-convention-assumed` | no document states the layout's signs or units; the row below says what is assumed |
| `flat-radar` | every return has the same height: the radar measures no elevation |

"""


_FILES = """\
## Files without ROS

Folders and files can be given beside recordings of ROS or without any: `cocalib open RADAR_FRONT/ CAM_FRONT/`, or the
folder that holds them.

| what | read as |
|---|---|
| folder of `.pcd` (version 0.7, binary or ascii) | radar, one scan per file; by its fields as a PointCloud2, nuScenes included |
| folder of `.bin` | View-of-Delft radar, one scan per file |
| `.csv` | radar; the first line names columns and units: `{example}` |
| folder of pictures | camera |
| video file, with `--video-start` | camera; most videos lose the frames' own times: give the recording where there is one |

The time of a file is in a CSV beside it (`file,time_ns`), or in its name: the last number of 19 digits (ns), 16 (us),
13 (ms) or 10 (s, with a fraction or without) that is a date after 2001. Files that are only numbered count as 0.1 s
apart, and that is said.

### Columns of a radar CSV

Columns are parted by commas, semicolons or tabs. A unit stands behind the name, as `x_m` or `x [m]`. Rows of one time
are one scan. An unknown unit, or none, is an error; columns of other names are left out, and `cocalib info` says so.
Axes and signs are those of the radar frame.

| column | units |
|---|---|
{columns}
"""


def radar_formats() -> str:
    """Write the page."""
    parts = [_INTRODUCTION.rstrip("\n"), ""]
    for kind, title in _KINDS.items():
        parts += [f"## {title}", "", *_table([decoder for decoder in DECODERS if decoder.kind == kind]), ""]
    parts += [_FILES.format(example=CSV_EXAMPLE, columns="\n".join(csv_columns())).rstrip("\n"), "", "## Remarks", ""]
    parts += [
        f"* **{d.name}**: {'; '.join(filter(None, (d.note, d.assumed)))}." for d in DECODERS if d.note or d.assumed
    ]
    return "\n".join(parts) + "\n"


def _table(decoders: list[Decoder]) -> list[str]:
    rows = [
        "| layout | used by | position [m, angles as said] | axes | angles | speed [m/s] | amplitude | noise |",
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
    """Write the page into a file."""
    Path(path).write_text(radar_formats(), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
