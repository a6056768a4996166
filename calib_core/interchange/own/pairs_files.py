"""Ready-made pairs, for scripts that do their own pairing: pairs-1, written and read, and tables (CSV) of five numbers a row."""

import csv
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.association.array_pairs import pairs_from_arrays, too_near
from calib_core.camera import Camera
from calib_core.errors import InputError
from calib_core.interchange.own.documents import (
    PAIRS_SCHEMA,
    PairDocument,
    PairsDocument,
    PositionDocument,
    RadarDocument,
    camera_document,
    camera_of,
    refuse_repeated_ids,
)
from calib_core.interchange.syntax.strict_json import document_text, parse_document
from calib_core.measurements import Candidate, Pair
from calib_core.options import CalibrationOptions, CameraPositionPrior, NoiseOptions
from calib_core.radar import covariance_from_sigma_polar


@dataclass(frozen=True, slots=True, eq=False)
class PairsFile:
    """The content of a pairs-1 file.

    Attributes:
        camera: the camera the pixels were clicked in.
        pairs: all pairs of the file, in its order; each candidate has the noise of the file or of the options.
        sigma_range_m: of one radar position [m]; None if the file does not state it.
        sigma_azimuth_rad: the same for its azimuth [rad].
        sigma_elevation_rad: the same for its elevation [rad].
        camera_position: the tape-measured camera centre; None if the file has none.
    """

    camera: Camera
    pairs: tuple[Pair, ...]
    sigma_range_m: float | None = None
    sigma_azimuth_rad: float | None = None
    sigma_elevation_rad: float | None = None
    camera_position: CameraPositionPrior | None = None

    def options(self, given: CalibrationOptions) -> CalibrationOptions:
        """Return the options, overridden by what the file states."""
        noise = given.noise
        if self.sigma_range_m is not None:
            noise = dataclasses.replace(noise, sigma_range_m=self.sigma_range_m)
        if self.sigma_azimuth_rad is not None:
            noise = dataclasses.replace(noise, sigma_azimuth_deg=math.degrees(self.sigma_azimuth_rad))
        if self.sigma_elevation_rad is not None:
            noise = dataclasses.replace(noise, sigma_elevation_deg=math.degrees(self.sigma_elevation_rad))
        solving = given.solving
        if self.camera_position is not None:
            solving = dataclasses.replace(solving, camera_position=self.camera_position)
        return dataclasses.replace(given, noise=noise, solving=solving)


def read_pairs(text: str, source: str = "pairs", *, noise: NoiseOptions | None = None) -> PairsFile:
    """Read pairs-1 text.

    Args:
        text: the file's content.
        source: the name of the file in error messages.
        noise: used where the file states none; None uses the defaults.

    Raises:
        InputError: invalid content; the message names the file, the place and what to do.
    """
    document = parse_document(text, PairsDocument, source=source)
    refuse_repeated_ids([pair.id for pair in document.pairs], source=source, place="pairs")
    radar = document.radar or RadarDocument()
    sigma_polar = _sigma_polar(radar, noise or NoiseOptions())
    pairs = tuple(
        _pair(pair, sigma_polar, source=source, place=f"pairs[{index}]") for index, pair in enumerate(document.pairs)
    )
    position = document.camera_position_in_radar
    return PairsFile(
        camera=camera_of(document.camera, source=source),
        pairs=pairs,
        sigma_range_m=radar.sigma_range_m,
        sigma_azimuth_rad=radar.sigma_azimuth_rad,
        sigma_elevation_rad=radar.sigma_elevation_rad,
        camera_position=CameraPositionPrior(position.position_m, position.sigma_m) if position else None,
    )


def read_pairs_table(
    text: str, camera: Camera, source: str = "pairs", *, noise: NoiseOptions | None = None
) -> PairsFile:
    """Read pairs from a table with commas, semicolons, tabs or spaces between its columns.

    Args:
        text: a row for each pair: x, y, z in the radar frame [m], u, v [px], and maybe an id. A first row may name the columns,
            which may then have any order, with or without units: `id,u_px,v_px,x_m,y_m,z_m`.
        camera: the camera that the pixels are of.
        source: the name of the table in error messages.
        noise: of the radar; None uses the defaults.

    Raises:
        InputError: a row is not five numbers, or a column is missing; the message names the line and what to do.
    """
    rows = [(number, cells) for number, cells in enumerate(_cells(text), 1) if cells]
    columns: Sequence[str] = (*_TABLE_COLUMNS, "id")
    if rows and not _is_number(rows[0][1][0]):
        columns = _named_columns(rows.pop(0)[1], f"{source}: its first line '{text.strip().splitlines()[0][:80]}'")
    if not rows:
        raise InputError(f"{source}: has no rows; {_TABLE_HINT}")
    numbers, ids = [], []
    for line, cells in rows:
        row = dict(zip(columns, cells, strict=False))
        if len(cells) > len(columns) or not all(_is_number(row.get(name, "")) for name in _TABLE_COLUMNS):
            commas = (
                "write decimal points, not commas; "
                if any(_is_number(cell.replace(",", ".")) for cell in cells if "," in cell)
                else ""
            )
            raise InputError(
                f"{source}: line {line}: '{text.splitlines()[line - 1]}' is not a pair; {commas}{_TABLE_HINT}"
            )
        numbers.append([float(row[name]) for name in _TABLE_COLUMNS])
        ids.append(row.get("id") or f"pair-{len(numbers)}")
    values = np.array(numbers)
    try:
        return PairsFile(camera, pairs_from_arrays(values[:, :3], values[:, 3:], noise=noise, ids=ids))
    except InputError as error:
        raise InputError(f"{source}: {error}") from None


def write_pairs(pairs_file: PairsFile) -> str:
    """Write pairs-1 text; the same pairs give the same bytes."""
    sigmas = (pairs_file.sigma_range_m, pairs_file.sigma_azimuth_rad, pairs_file.sigma_elevation_rad)
    prior = pairs_file.camera_position
    document = PairsDocument(
        PAIRS_SCHEMA,
        camera_document(pairs_file.camera),
        [_pair_document(pair) for pair in pairs_file.pairs],
        radar=None if sigmas == (None, None, None) else RadarDocument(*sigmas),
        camera_position_in_radar=PositionDocument(prior.position_m, prior.sigma_m) if prior else None,
    )
    return document_text(document)


_TABLE_COLUMNS = ("x", "y", "z", "u", "v")
_TABLE_HINT = "a table of pairs has the columns x, y, z of the radar [m] and u, v of the image [px], and maybe id"


def _cells(text: str) -> list[list[str]]:
    """Split a table into cells: by the first of semicolon, tab, comma that its first line has, else by spaces."""
    lines = text.removeprefix("\ufeff").splitlines()
    delimiter = next((one for one in ";\t," if lines and one in lines[0]), None)
    split = [line.split() for line in lines] if delimiter is None else csv.reader(lines, delimiter=delimiter)
    return [[cell.strip() for cell in cells] for cells in split]


def _named_columns(names: Sequence[str], line: str) -> Sequence[str]:
    columns = [name.lower().removesuffix("_px").removesuffix("_m") for name in names]
    missing = [name for name in _TABLE_COLUMNS if columns.count(name) != 1]
    if missing:
        raise InputError(f"{line} does not name {' and '.join(missing)} once; {_TABLE_HINT}")
    return columns


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _sigma_polar(radar: RadarDocument, noise: NoiseOptions) -> Vector3:
    azimuth_rad, elevation_rad = math.radians(noise.sigma_azimuth_deg), math.radians(noise.sigma_elevation_deg)
    return np.array(
        [
            noise.sigma_range_m if radar.sigma_range_m is None else radar.sigma_range_m,
            azimuth_rad if radar.sigma_azimuth_rad is None else radar.sigma_azimuth_rad,
            elevation_rad if radar.sigma_elevation_rad is None else radar.sigma_elevation_rad,
        ]
    )


def _pair(document: PairDocument, sigma_polar: Vector3, *, source: str, place: str) -> Pair:
    """Return a pair whose positions are equally likely, because the file does not weight them."""
    positions = np.array([document.radar_m, *document.alternatives_radar_m])
    for index, position in enumerate(positions):
        if near := too_near(position):
            where = f"{place}.alternatives_radar_m[{index - 1}]" if index else f"{place}.radar_m"
            raise InputError(f"{source}: {where}: {near}")
    covariances = covariance_from_sigma_polar(positions, np.broadcast_to(sigma_polar, positions.shape))
    return Pair(
        id=document.id,
        pixel_px=np.array(document.pixel_px),
        candidates=tuple(
            Candidate(position, sigma_polar, covariance, score=1.0 / len(positions))
            for position, covariance in zip(positions, covariances, strict=True)
        ),
        sigma_px=document.sigma_px,
    )


def _pair_document(pair: Pair) -> PairDocument:
    first, *others = (candidate.position_radar_m.tolist() for candidate in pair.candidates)
    u_px, v_px = pair.pixel_px.tolist()
    return PairDocument(pair.id, tuple(first), (u_px, v_px), [tuple(other) for other in others], sigma_px=pair.sigma_px)
