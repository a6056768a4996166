"""Ready-made pairs, for scripts that do their own pairing: pairs-1, written and read."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from calib_core.arrays import Vector3
from calib_core.association.array_pairs import too_near
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
        camera_position: the tape-measured camera center; None if the file has none.
        assumed: what a table does not state about units and axes, and was assumed.
    """

    camera: Camera
    pairs: tuple[Pair, ...]
    sigma_range_m: float | None = None
    sigma_azimuth_rad: float | None = None
    sigma_elevation_rad: float | None = None
    camera_position: CameraPositionPrior | None = None
    assumed: tuple[str, ...] = ()

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
