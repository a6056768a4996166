"""How often the reflector's apex is found, how well, and how often where there is none: python -m benchmarks.apex

Each row draws places from images that were not used to set limits or covariance. A found apex is wrong if it is farther from
the truth than 1.5 px and four of its own sigmas. The last columns hold the share of errors inside the 50, 90 and 99 % ellipses.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from calib_core.proposing.apex import Apex, find_apex
from calib_core.synthetic.options import SimulationOptions
from calib_core.synthetic.recording import simulate
from tests.unit.proposing.trihedral import background, draw_look, noisy_image

_SCENES = ("rooftop", "field", "aisle", "checkerboard")
_SIZES = ((960, 540), (1920, 1080))
_OWN_WIDTHS_PX = ((10.0, 15.0), (15.0, 25.0), (25.0, 50.0), (50.0, 100.0), (100.0, 200.0))
_OFF_PX = 8.0
_QUANTILES = (1.386, 4.605, 9.210)
"""Of the chi-squared distribution with two degrees of freedom, at 50, 90 and 99 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Place:
    """An image, where to search, and the true apex; None if there is none."""

    row: str
    image: np.ndarray
    near_px: np.ndarray
    apex_px: np.ndarray | None


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=7000)
    parser.add_argument("--own", type=int, default=200, help="images of our own per width")
    parser.add_argument("--photos", type=Path, default=Path("../shared/data/real_checkerboards"))
    arguments = parser.parse_args()
    seconds: list[float] = []
    print("| images | n | found | wrong | median error [px] | 95 % [px] | median sigma [px] | in 50 % | 90 % | 99 % |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for family in (
        _our_own(arguments.seed, arguments.own),
        _photographs(arguments.seed, arguments.photos),
        _simulated(arguments.seed),
    ):
        _print_rows(family, seconds)
    print(
        f"\nprocessor time per call: median {1e3 * np.median(seconds):.0f} ms, 95 % {1e3 * np.quantile(seconds, 0.95):.0f} ms"
    )


def _print_rows(places: Iterator[Place], seconds: list[float]) -> None:
    """Search at each place, and print the rows of a family; without a reflector, how often an apex was found."""
    answers: dict[str, list[Apex | None]] = {}
    truth: dict[str, list[np.ndarray]] = {}
    for place in places:
        started = time.process_time()
        answer = find_apex(place.image, place.near_px)
        seconds.append(time.process_time() - started)
        answers.setdefault(place.row, []).append(answer if isinstance(answer, Apex) else None)
        if place.apex_px is not None:
            truth.setdefault(place.row, []).append(place.apex_px)
    for row, found in answers.items():
        if row in truth:
            print(_present_row(row, found, truth[row]), flush=True)
        else:
            share = np.mean([one is not None for one in found])
            print(f"| no reflector: {row} | {len(found)} | {100.0 * share:.1f} % | | | | | | | |", flush=True)


def _present_row(row: str, answers: list[Apex | None], truth: list[np.ndarray]) -> str:
    pairs = [(one, apex) for one, apex in zip(answers, truth, strict=True) if one is not None]
    share = len(pairs) / len(answers)
    if not pairs:
        return f"| {row} | {len(answers)} | 0 % | | | | | | | |"
    errors = np.array([one.pixel_px - apex for one, apex in pairs])
    sigmas = np.array([one.sigma_px for one, _ in pairs])
    lengths = np.hypot(*errors.T)
    wrong = int(np.sum(lengths > np.maximum(1.5, 4.0 * sigmas)))
    squares = np.array([e @ np.linalg.solve(one.covariance_px2, e) for e, (one, _) in zip(errors, pairs, strict=True)])
    inside = " | ".join(f"{100.0 * np.mean(squares < limit):.0f} %" for limit in _QUANTILES)
    return (
        f"| {row} | {len(answers)} | {100.0 * share:.0f} % | {wrong} | {np.median(lengths):.2f} | "
        f"{np.quantile(lengths, 0.95):.2f} | {np.median(sigmas):.2f} | {inside} |"
    )


def _simulated(seed: int) -> Iterator[Place]:
    """Yield places at the simulator's reflectors and far from them, with noise and JPEG."""
    for scene in _SCENES:
        for width_px, height_px in _SIZES:
            options = SimulationOptions(seed=seed, scene=scene, width_px=width_px, height_px=height_px)
            recording = simulate(options)
            rng = np.random.default_rng(seed)
            times = recording.stage.frame_times
            for placement in recording.placements:
                moment_s = float(times.moment_s[int(np.argmin(np.abs(times.header_ns - placement.best_image_time)))])
                clean = recording.renderer.render(
                    recording.stage.story.at(moment_s), noise_grey=float(rng.uniform(0.0, 3.0)), rng=rng
                )
                image = _compressed(clean, int(rng.integers(60, 96)))
                range_m = float(np.linalg.norm(placement.position_radar_m))
                near_far = "up to 8 m" if range_m <= 8.0 else "beyond 8 m"
                row = f"simulator, {width_px} x {height_px}, {near_far}"
                yield Place(row, image, placement.pixel_px + _offset(rng), placement.pixel_px)
                for _ in range(4):
                    away = rng.uniform([20, 0.2 * height_px], [width_px - 20, height_px - 20])
                    if np.hypot(*(away - placement.pixel_px)) > 100.0:
                        yield Place("simulator, away from the reflector", image, away, None)


def _our_own(seed: int, count: int) -> Iterator[Place]:
    """Yield places in images of `tests.unit.proposing.trihedral`, and in their backgrounds alone."""
    side = (220, 220)
    for low_px, high_px in _OWN_WIDTHS_PX:
        for number in range(count):
            rng = np.random.default_rng([seed, int(low_px), number])
            look = draw_look(rng, size_px=side, width_px=float(rng.uniform(low_px, high_px)))
            image = noisy_image(look, background(rng, side), rng)
            yield Place(
                f"ray by ray, {low_px:.0f} to {high_px:.0f} px wide", image, look.apex_px + _offset(rng), look.apex_px
            )
    for number in range(2 * count):
        rng = np.random.default_rng([seed, number])
        look = replace(draw_look(rng, size_px=side, width_px=1.0), apex_px=np.array([4.0, 4.0]))
        yield Place(
            "ray by ray, blocks, lines and texture",
            noisy_image(look, background(rng, side), rng),
            np.array([110.0, 110.0]),
            None,
        )


def _photographs(seed: int, folder: Path) -> Iterator[Place]:
    """Yield random places in photographs of a checkerboard in a room, and the corners of the board."""
    rng = np.random.default_rng(seed)
    for path in sorted(folder.glob("*.jpg")):
        image = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        for _ in range(20):
            away = rng.uniform([20.0, 20.0], [image.shape[1] - 20.0, image.shape[0] - 20.0])
            yield Place("photographs, anywhere", image, away, None)
        good, corners = cv2.findChessboardCorners(image, (9, 6))
        for corner in corners.reshape(-1, 2)[::5] if good else ():
            yield Place("photographs, corners of the checkerboard", image, corner.astype(float), None)


def _offset(rng: np.random.Generator) -> np.ndarray:
    turn, length = rng.uniform(0.0, 2.0 * np.pi), _OFF_PX * np.sqrt(rng.uniform())
    return np.asarray(length * np.array([np.cos(turn), np.sin(turn)]))


def _compressed(image: np.ndarray, quality: int) -> np.ndarray:
    data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR))


if __name__ == "__main__":
    main()
