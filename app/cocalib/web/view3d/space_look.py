"""What the page draws over the 3D view and can pick there, as a message; positions in the picture go through the lens."""

from collections.abc import Iterator

import numpy as np

from calib_core.arrays import Points2, Points3, Values
from calib_core.results import Calibration, PairResult
from cocalib.web.messages import SpaceLabel, SpaceLook, SpacePlacement, SpaceReflector, SpaceReturn
from cocalib.web.view3d.extent import ring_ranges_m
from cocalib.web.view3d.returns import SIZES, Returns, size_classes
from cocalib.web.view3d.sight import Sight, true_positions

_MOST_RETURNS = 3000
"""So many returns can be picked; of more, every other or every tenth and so on."""
_MOST_IN_WINDOW = 1000


def space_look(sight: Sight) -> SpaceLook:
    """Describe a Sight for the page."""
    calibration = sight.calibration
    solved = sight.session.outcome
    pairs = solved.pairs if isinstance(solved, Calibration) else ()
    return SpaceLook(
        number=sight.number,
        index=sight.index,
        returns=_seen(sight, sight.returns, _MOST_RETURNS),
        window=_seen(sight, sight.window, _MOST_IN_WINDOW),
        reflectors=tuple(_reflectors(solved, pairs)) if isinstance(solved, Calibration) else (),
        placements=_placements(sight),
        labels=tuple(_labels(sight)),
        rings_m=ring_ranges_m(sight.extent.range_m),
        ground_m=round(ground_m(sight), 3),
        range_m=round(sight.extent.range_m, 3),
        legend=sight.colouring.legend(),
        projected=calibration is not None,
    )


def ground_m(sight: Sight) -> float:
    """Return the height at which the rings lie: of the lowest inlier, or at most that of the radar."""
    calibration = sight.calibration
    inliers = tuple(pair for pair in calibration.pairs if pair.inlier) if calibration else ()
    return float(min([0.0, *true_positions(calibration, inliers)[:, 2].tolist()])) if calibration else 0.0


def _seen(sight: Sight, returns: Returns, most: int) -> tuple[SpaceReturn, ...]:
    """Return at most so many returns, evenly spaced, as rows."""
    if len(returns) > most:
        returns = returns.rows(np.arange(0, len(returns), -(-len(returns) // most)))
    pixels = _pixels(sight.calibration, returns.points_m)
    colours = sight.colouring.of(returns, sight.trail_s)
    sizes = [SIZES[number] for number in size_classes(returns.snr_db, sight.snr_db)]
    degrees = np.column_stack([returns.polar[:, 0], np.rad2deg(returns.polar[:, 1:])])
    columns = (returns.points_m, degrees, returns.doppler_mps, returns.snr_db, returns.still, returns.age_s, pixels)
    return tuple(
        SpaceReturn(
            x_m=round(float(point[0]), 3),
            y_m=round(float(point[1]), 3),
            z_m=round(float(point[2]), 3),
            range_m=round(float(polar[0]), 3),
            azimuth_deg=round(float(polar[1]), 2),
            elevation_deg=round(float(polar[2]), 2),
            doppler_mps=_number(doppler),
            snr_db=_number(snr),
            static=bool(still),
            age_s=round(float(age_s), 3),
            u_px=_number(pixel[0]),
            v_px=_number(pixel[1]),
            colour="#{:02x}{:02x}{:02x}".format(*colour),
            size=size,
        )
        for point, polar, doppler, snr, still, age_s, pixel, colour, size in zip(*columns, colours, sizes, strict=True)
    )


def _reflectors(calibration: Calibration, pairs: tuple[PairResult, ...]) -> Iterator[SpaceReflector]:
    points = true_positions(calibration, pairs)
    for pair, point, pixel in zip(pairs, points, _pixels(calibration, points), strict=True):
        yield SpaceReflector(pair.id, _rounded(point), _pixel(pixel))


def _placements(sight: Sight) -> tuple[SpacePlacement, ...]:
    positions = np.array([placement.position_radar_m for placement in sight.placements]).reshape(-1, 3)
    points = sight.errors.corrected(positions)
    rows = zip(points, _pixels(sight.calibration, points), sight.placement_states(), strict=True)
    return tuple(SpacePlacement(_rounded(point), _pixel(pixel), state) for point, pixel, state in rows)


def _labels(sight: Sight) -> Iterator[SpaceLabel]:
    """Yield the words at points: the selected pair, and the best next placement."""
    solved, advice = sight.session.outcome, sight.view.advice
    if isinstance(solved, Calibration):
        for pair in solved.pairs:
            if pair.id == sight.selected:
                reported_m = float(np.linalg.norm(pair.point_radar_m))
                words = f"{pair.id}: {reported_m:.2f} m, {_residual(pair)}"
                yield SpaceLabel(words, _rounded(true_positions(solved, (pair,))[0]), "selected")
    if advice is not None and not (advice.may_stop or sight.view.verdict.done):
        yield SpaceLabel(f"next {advice.range_m:.1f} m", _rounded(np.array(advice.position_radar_m)), "next")


def _residual(pair: PairResult) -> str:
    return f"{pair.distance_px:.1f} px" if np.isfinite(pair.distance_px) else "behind the camera"


def _pixels(calibration: Calibration | None, points_m: Points3) -> Points2:
    """Return where points (n, 3) are in the picture (n, 2), through its lens; NaN if they are not in it."""
    pixels = np.full((len(points_m), 2), np.nan)
    if calibration is not None and len(points_m):
        points_camera = calibration.camera_from_radar @ points_m
        seen = calibration.camera.sees(points_camera)
        pixels[seen] = calibration.camera.project(points_camera[seen])
    return pixels


def _pixel(pixel: Values) -> tuple[float, float] | None:
    return (round(float(pixel[0]), 2), round(float(pixel[1]), 2)) if np.isfinite(pixel).all() else None


def _rounded(point: Values) -> tuple[float, float, float]:
    x_m, y_m, z_m = point.tolist()
    return round(x_m, 3), round(y_m, 3), round(z_m, 3)


def _number(value: float) -> float | None:
    return None if np.isnan(value) else round(float(value), 3)
