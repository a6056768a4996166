"""The page docs/radar-formats.md, generated from the registry of radar layouts.

python -m calib_core.recordings.registry_table docs/radar-formats.md
"""

import sys
from pathlib import Path

from calib_core.recordings.plain_files.tables.text_tables import csv_columns
from calib_core.recordings.plain_files.tables.times import TABLE_EXAMPLE
from calib_core.recordings.radar.column_plans import plan_for
from calib_core.recordings.radar.registry import DECODERS, Decoder, MessageKind
from calib_core.recordings.time.written_times import DATE_SPELLINGS

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
`python -m calib_core.recordings.registry_table docs/radar-formats.md`. Each row is tested with messages built from the
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
contradict it: positions beyond 1 km get the likeliest unit, an assumption. `cocalib info` lists for each
quantity the field, its unit, the direction in which it grows, and how this is known.

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
folder that contains them, or the folder of a data set, five levels deep. What was looked at and not used is named with the reason
(`unused-files`).

| what | read as |
|---|---|
| folder of `.pcd` (version 0.7, binary or ascii), such as nuScenes | radar, one scan per file; recognised like a PointCloud2 |
| folder of `.bin` | View-of-Delft radar, one scan per file; four floats a point (KITTI) are a lidar's and not used |
| `.bin`, `.dat` of a TI data port, or a folder with them | radar, judged by the bytes; [see below](#data-port-of-ti-radars) |
| `.csv`, `.tsv`, `.txt`, `.jsonl`, `.ndjson`, `.json` | radar; see below. The first line of a CSV names columns and units: `{example}` |
| folder of `.csv`, `.txt` or `.json` with one scan each | radar; times inside, or in the file names |
| folder of pictures | camera; pictures that cannot be decoded are left out and counted (`unreadable-pictures`) |
| video file, with `--video-start` | camera; most videos do not store the original frame times: use the recording if possible |

### Times of files

The time of a file comes from a table in or next to its folder (`file,time_ns`, or `timestamps.txt` with one time per line), or from its
name: the last number of 19 digits (ns), 16 (us), 13 (ms) or 10 (s, with or without a fraction) that is a date after 2001, or a date
with a time of day. These are one moment:

{dates}

The digits after the second may also be 3 or 9, or none. With 3, 6 or 9 digits they are a fraction, unless they count the files
(steps of one within a second, or through all of them): the files of a second are then spread evenly over it. Anything else is read
the way that gives the steadiest rate. Both are stated as assumptions. Numbers in the names that contradict the order of the times give
the warning `file-order`. Files that are only numbered have the times of the pictures with the same numbers if those have any;
otherwise they are 0.1 s apart. A warning says so (`numbered-files`), and next to a sensor with real times it is an assumption.

Dates without a time zone are UTC. Where the other sensor's times are not of this kind that is an assumption: state the zone with
`--time-zone +02:00`. If only a zone separates radar and camera, the error names it.

### Data port of TI radars

The bytes that the demos of TI's mmWave SDK send over the data port (AWR1843, IWR6843 and others), as a terminal program or a
script stored them. Packets begin with the magic word `02 01 04 03 06 05 08 07`; after garbage or a cut packet reading goes on
at the next one, and `cocalib info` counts what was skipped and which frame numbers are missing. Read are the points (SDK 3:
metres and m/s as floats; SDK 1 and 2: fixed point) and the SNR in 0.1 dB (amplitude); range profiles, heat maps, statistics
and temperatures are named and skipped. SDK 1 and 2 send the Doppler only as the number of a bin whose size the stream does
not state: such scans have no speed. TI counts x to the right, y forward and z up; points are turned to x forward, y left, z up.

The stream carries no dates. `--radar-start TIME` is the time of its first frame, and `--radar-start TIME,SECONDS` also the
time between frames. Otherwise that is measured by the processor cycles in the packets, read as 200 MHz, which the stream does
not state: an assumption that `cocalib info` lists. A list beside the file, `NAME.csv` or `NAME.txt` with one time per packet
in the last column, takes precedence over both. Logs of the configuration port and raw samples of a DCA1000 (`adc_data.bin`)
hold no detections and are refused by name.

### Data sets

| data set | open | intrinsics | published pose |
|---|---|---|---|
| View-of-Delft, KITTI object | its root, or a folder with `image_2` and `velodyne` | P2 of `calib/NUMBER.txt` | `--calibration calib/NUMBER.txt` |
| KITTI raw | a drive | `calib_cam_to_cam.txt` of the day: rectified, or raw if the pictures have the raw size | lidar only |
| nuScenes | its root | `v1.0-*/calibrated_sensor.json`, of the car the pictures come from | in the same file |

Intrinsics without a size are for the pictures' own size. Of several cameras or radars the one whose name contains "front" is chosen;
`--radar-topic` and `--image-topic` choose another. Sums of scans beside the scans (`radar_3frames`, `radar_5frames`) and the
`sweeps` beside `samples` are named and not used; open them by their own paths.

### Warnings about files

| code | meaning |
|---|---|
| `unused-files` | files and folders that were looked at and not used, each with the reason; at most six are named |
| `unreadable-pictures` | pictures with no bytes, cut off, or of another kind of file; they are no frames |
| `unstamped-files` | files without a time in a folder where others have one; they are skipped |
| `numbered-files` | numbers instead of times: those of the pictures with the same numbers, or 0.1 s apart |
| `file-order` | the times and the numbers in the file names disagree about the order |
| `cut-off-row` | a table ends within a row, which is left out |
| `camera-changes` | the data set has other intrinsics for other frames; those of the first are used |
| `assumed` | one per assumption below |

## Radar CSV and JSON lines

Columns are separated by commas, semicolons, tabs, bars or spaces, in UTF-8, UTF-16 or Latin-1, with decimal points or commas. Lines before the
header, comments (`#`, `%`, `//`), quotes and a line of units under the header are understood. Case, separators, letters for the type
(`f_Range`) and words for a return (`detections.`) do not matter: `f_PosX [m]`, `posX_m` and `position.x` are all x. The unit follows the
name, as in `x_m`, `x [m]` or `xMeters`. Rows with the same time form one scan. A cell may hold a list (`"[1.0, 2.0]"` or `1;2`): the row
is then a whole scan. Columns that nobody knows are ignored and named in the list of files.

JSON is read alike: one return or one scan per line or array element, with nested objects, lists of objects, or lists of numbers.
A position in a list of two or three numbers is x, y, z.

What names do not state is decided by the values if they can: range and x, y, z verify each other, and so do azimuth and x, y; angles
above 2 pi are degrees; a number that is a time between 1990 and 2060 in one unit has that unit. What is then still open is
**assumed and stated** (`cocalib info`; `solve` exits with 2 until it is confirmed), and can be said with `--map`:

| key | given when | stated by |
|---|---|---|
| `length-unit`, `angle-unit`, `speed-unit`, `time-unit` | a column has no unit, and no other column decides it | `--map x=posX:m` |
| `azimuth-sign` | only angles are given, and their column is not spelled `azimuth_deg` or `azimuth_rad`, which is positive to the left | `--map azimuth=-theta:deg` |
| `axes` | names such as lateral, posY; or y is never negative and x has both signs: read as x right, y forward | `--radar-axes` |
| `field-meaning` | two columns have the name of one quantity | `--map range=range_m:m` |
| `time-scale` | a column named GPS: 18 s ahead of UTC | |
| `time-zone`, `frame-interval`, `name-times` | see the times of files | `--time-zone`, a table of times |

Where the values fit two units alike, such as angles up to 2.5, the table is refused with the `--map` to type.

A column that `--map` names and that does not exist is an error with the nearest name. A file without a header needs one, or `--map` with
numbers of columns: `--map time=1:s --map x=2:m --map y=3:m`.

Spellings, in any order of their words and with or without separators, and units; the first is ours. Messages know the same
spellings of positions, speeds and levels:

| quantity | spellings | units |
|---|---|---|
{columns}
"""  # noqa: E501


def radar_formats() -> str:
    """Return the page."""
    parts = [_INTRODUCTION.rstrip("\n"), ""]
    for kind, title in _KINDS.items():
        parts += [f"## {title}", "", *_table([decoder for decoder in DECODERS if decoder.kind == kind]), ""]
    dates = "\n".join(f"* `{spelling}`" for spelling in DATE_SPELLINGS)
    files = _FILES.format(example=TABLE_EXAMPLE, columns="\n".join(csv_columns()), dates=dates)
    parts += [files.rstrip("\n"), "", "## Notes", ""]
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
