"""The still image as a witness: rendered scenes in other light, with other cars, in rain; the camera turned, or it did not.

A scene is rendered as the baseline saw it and as it is later, at 960 x 540 pixels: the turned camera is rendered too, not warped.
A background is the median of frames with noise of their own, as a watch makes it.
"""

import contextlib
import zlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from calib_core.camera import Camera
from calib_core.errors import OptionError
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.measurements import NS_PER_S, RadarScans, TimeNs
from calib_core.radar import RadarErrors
from calib_core.synthetic.options import SimulationOptions, Surroundings
from calib_core.synthetic.rendering.still import trace_still
from calib_core.synthetic.rig import Rig
from calib_core.synthetic.scene.scenes import Scene, scene_named
from calib_core.synthetic.scene.stage import set_stage
from calib_core.synthetic.scene.surroundings import furnished
from calib_core.watching.baseline import BASELINE_SCHEMA, Baseline, encoded
from calib_core.watching.still_image import background
from calib_core.watching.traffic import Watched
from calib_core.watching.watching import Stretch, Watch
from calib_core.watching.witnesses import SeenTurn

__all__ = ["report"]

_SCENES = ("rooftop", "field", "road", "checkerboard")
_TURN_DEG = (0.05, 0.05, 0.0)
_FRAMES = 7
_NOISE_GREY = 2.0
_STRETCHES = 3
_STREAKS = 250


def report(seed: int, count: int, folder: Path | None) -> Iterator[str]:
    """Yield what the still image says of each change, over a number of scenes with seeds of their own."""
    found: dict[str, list[tuple[SeenTurn, SeenTurn]]] = {}
    for number in range(count):
        for name, pair in _watched(seed + number, _SCENES[number % len(_SCENES)], folder):
            found.setdefault(name, []).append(pair)
    yield f"{count} scenes, {_STRETCHES} stretches each; turned: {_TURN_DEG[0]} deg of pitch and of yaw"
    yield "| change | alarms | seen: pitch, yaw | rms error of pitch, yaw, roll [deg] | over sigma | least that counts [deg] |"
    yield "|---|---|---|---|---|---|"
    for name, pairs in found.items():
        still, turned = ([pair[which] for pair in pairs] for which in (0, 1))
        alarms = sum(bool(seen.turned.any()) for seen in still)
        seen = ", ".join(str(sum(bool(one.turned[axis]) for one in turned)) for axis in (0, 1))
        errors = np.array(
            [one.rotation_rad for one in still] + [one.rotation_rad - np.deg2rad(_TURN_DEG) for one in turned]
        )
        sigmas = np.array([one.sigma_rad for one in (*still, *turned)])
        size, z = (
            ", ".join(f"{value:.3f}" for value in np.sqrt((one**2).mean(axis=0)))
            for one in (np.rad2deg(errors), errors / sigmas)
        )
        least = ", ".join(f"{value:.3f}" for value in np.rad2deg(np.median([one.least_rad for one in still], axis=0)))
        yield f"| {name} | {alarms} of {len(pairs)} | {seen} of {len(pairs)} | {size} | {z} | {least} |"


def _watched(seed: int, scene_name: str, folder: Path | None) -> Iterator[tuple[str, tuple[SeenTurn, SeenTurn]]]:
    """Yield what a watch says of a scene after each change, without a turn and with one."""
    stage = set_stage(SimulationOptions(scene=scene_name, seed=seed, placements=1, width_px=960, height_px=540))
    camera, plain = stage.rig.camera, scene_named(scene_name)
    cars = [_with_cars(plain, seed, which) for which in (1, 2)]
    rng = np.random.default_rng([seed, 3])
    first = cars[0]
    later = replace(
        first, sun_azimuth_deg=first.sun_azimuth_deg + 25.0, sun_elevation_deg=first.sun_elevation_deg - 8.0
    )
    low = {"sun_azimuth_deg": first.sun_azimuth_deg - 70.0, "sun_elevation_deg": 16.0}
    changes = {
        "nothing": (first, _as_it_is),
        "light of two hours later": (later, _as_it_is),
        "long shadows of a low sun": (replace(first, **low), _as_it_is),
        "half the exposure": (first, _darker),
        "1.6 times the exposure": (first, _brighter),
        "rain": (first, _wet),
        "other parked cars": (cars[1], _as_it_is),
        "no parked cars": (plain, _as_it_is),
        "low sun, other cars, darker, rain": (
            replace(cars[1], **low),
            lambda image, rng: _wet(_darker(image, rng), rng),
        ),
    }
    seen = _rendered(first, stage.rig, folder, seed, (0.0, 0.0, 0.0))
    images = [encoded(_background(seen, rng)) for _ in range(2)]
    size = (camera.width_px, camera.height_px)
    baseline = Baseline(BASELINE_SCHEMA, "0" * 64, "rendered", TimeNs(0), TimeNs(1), size, images)
    for name, (scene, look) in changes.items():
        both = []
        for turn_deg in ((0.0, 0.0, 0.0), _TURN_DEG):
            image = look(_rendered(scene, stage.rig, folder, seed, turn_deg), rng)
            both.append(
                _seen(baseline, camera, [_background(image, rng, rain="rain" in name) for _ in range(_STRETCHES)])
            )
        yield name, (both[0], both[1])


def _with_cars(scene: Scene, seed: int, which: int) -> Scene:
    """Return a scene with two parked cars where there is room for them."""
    for attempt in range(100):
        with contextlib.suppress(OptionError):
            return furnished(np.random.default_rng([seed, which, attempt]), scene, Surroundings(parked_cars=2))[0]
    return scene


def _seen(baseline: Baseline, camera: Camera, images: list[np.ndarray]) -> SeenTurn:
    watch = Watch(baseline, Watched(RigidTransform(np.eye(3), np.zeros(3)), camera, RadarErrors()))
    for number, image in enumerate(images):
        times = (TimeNs(30 * NS_PER_S * one) for one in (number, number + 1))
        verdict = watch.add(Stretch(*times, image, RadarScans(), None, still=True))
    assert verdict.image is not None, "what is rendered registers"
    return verdict.image


def _rendered(scene: Scene, rig: Rig, folder: Path | None, seed: int, turn_deg: tuple[float, ...]) -> np.ndarray:
    """Return grey levels (h, w, 3) of a scene from a camera that turned; read from the folder if it is there."""
    look = zlib.crc32(repr((scene.solids, scene.towards_sun.tolist(), turn_deg)).encode())
    key = f"{scene.name}-{seed}-{look:08x}.png"
    path = None if folder is None else folder / key
    if path is not None and path.exists():
        return np.asarray(cv2.imread(str(path)))
    turn = RigidTransform(rotation_exp(np.deg2rad(turn_deg)), np.zeros(3))
    levels = trace_still(scene, replace(rig, camera_from_radar=turn @ rig.camera_from_radar)).levels
    image = np.clip(levels, 0.0, 255.0).round().astype(np.uint8)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path), image)
    return image


def _background(image: np.ndarray, rng: np.random.Generator, *, rain: bool = False) -> np.ndarray:
    """Return the background of frames with noise, JPEG's too, and in rain with streaks."""
    frames = []
    for _ in range(_FRAMES):
        frame = image.astype(np.float32)
        for _ in range(_STREAKS if rain else 0):
            x, y, length = (int(one) for one in rng.uniform((0, 0, 8), (image.shape[1], image.shape[0], 40)))
            cv2.line(frame, (x, y), (x + length // 6, y + length), (190.0, 190.0, 190.0), 1)
        noisy = np.clip(frame + _NOISE_GREY * rng.standard_normal(image.shape, dtype=np.float32), 0, 255).astype(
            np.uint8
        )
        frames.append(
            np.asarray(cv2.imdecode(cv2.imencode(".jpg", noisy, [cv2.IMWRITE_JPEG_QUALITY, 85])[1], cv2.IMREAD_COLOR))
        )
    found = background(frames)
    assert found is not None
    return found


def _as_it_is(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    del rng
    return image


def _darker(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    del rng
    return (0.5 * image.astype(np.float32)).astype(np.uint8)


def _brighter(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    del rng
    return np.clip(1.6 * image.astype(np.float32), 0, 255).astype(np.uint8)


def _wet(image: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return an image through rain: less contrast, a little blur, and a dozen drops on the lens."""
    hazy = cv2.GaussianBlur(0.7 * image.astype(np.float32) + 45.0, (0, 0), 0.8)
    blurred = cv2.GaussianBlur(hazy, (0, 0), 6.0)
    mask = np.zeros(image.shape[:2], dtype=np.float32)
    for _ in range(12):
        x, y, radius = (int(one) for one in rng.uniform((0, 0, 10), (image.shape[1], image.shape[0], 35)))
        cv2.circle(mask, (x, y), radius, 1.0, -1)
    share = cv2.GaussianBlur(mask, (0, 0), 3.0)[..., None]
    return np.clip(share * blurred + (1.0 - share) * hazy, 0, 255).astype(np.uint8)
