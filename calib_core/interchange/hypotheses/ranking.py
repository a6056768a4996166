"""Hypotheses about a pose, ranked: by how usual their meaning and mounting are, by pairs, and by another calibration."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calib_core.geometry import RigidTransform, rotation_angle_rad
from calib_core.interchange.check.pair_residuals import CheckPairs
from calib_core.interchange.check.pixel_differences import shown
from calib_core.interchange.hypotheses.found_poses import FoundPose
from calib_core.interchange.hypotheses.meanings import Meaning, meanings_of
from calib_core.interchange.hypotheses.mounting import is_usual, mounting_weight, mounting_words

_SAME_RAD, _SAME_M = 1e-4, 1e-4
_CLEAR = 0.95
_LEAST_SHARE = 0.01
_FEWEST, _MOST = 3, 9
_LEAST_SIGMA_PX = 1.0
_NEAR_PX = 0.03
_ANGLE_RAD, _APART_M = math.radians(2.0), 0.05
_NEAR_RAD, _NEAR_M = math.radians(10.0), 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Hypothesis:
    """One pose that the numbers in a file can mean.

    Attributes:
        meanings: every meaning that gives this pose; the most usual first.
        camera_from_radar: the pose.
        share: probability among all hypotheses, from how usual they are and from what they were tested with.
        miss_px: median distance between the projected pairs and their pixels; NaN without pairs, infinite behind the camera.
        apart: angle [rad] and distance [m] from the other calibration; NaN without one.
        fits: whether it passes the tests, or without any, whether sensors are often mounted like this.
    """

    meanings: tuple[Meaning, ...]
    camera_from_radar: RigidTransform
    share: float
    miss_px: float = math.nan
    apart: tuple[float, float] = (math.nan, math.nan)
    fits: bool = False

    @property
    def key(self) -> str:
        """What chooses it."""
        return self.meanings[0].key

    @property
    def score(self) -> str:
        """Its figures: the share, and how it passed the tests."""
        percent = 100 * self.share
        parts = [f"{percent:.0f} %" if percent >= 1 else "below 1 %"]
        if not math.isnan(self.miss_px):
            parts.append(
                f"pairs {shown(self.miss_px)} px off" if math.isfinite(self.miss_px) else "pairs behind the camera"
            )
        if not math.isnan(self.apart[0]):
            parts.append(
                f"{shown(math.degrees(self.apart[0]))} deg and {shown(self.apart[1])} m from the other calibration"
            )
        return ", ".join(parts)

    @property
    def words(self) -> str:
        """What it means, and where it puts the camera."""
        return f"{self.meanings[0].words}: {self.mounting}"

    @property
    def mounting(self) -> str:
        """Where it puts the camera, and where that looks."""
        return mounting_words(self.camera_from_radar)


def hypotheses_of(
    pose: FoundPose, *, pairs: CheckPairs | None = None, against: RigidTransform | None = None
) -> tuple[Hypothesis, ...]:
    """Return every different pose that the numbers can mean, the likeliest first.

    Args:
        pose: the numbers.
        pairs: radar positions and the pixels where they were seen; they decide where they differ.
        against: camera_from_radar of the same sensors from a calibration that is known to be right.
    """
    merged = [_tested(one, pairs, against) for one in _merged(meanings_of(pose))]
    scores = np.array([math.log(max(one.share, 1e-300)) for one in merged])
    if pairs is not None:
        scores += _by_pairs(merged, pairs)
    if against is not None:
        scores += [_by_distance(one) for one in merged]
    shares = np.exp(scores - scores.max())
    shares /= shares.sum()
    shared = [replace(one, share=float(share)) for one, share in zip(merged, shares, strict=True)]
    return tuple(sorted(shared, key=lambda one: (-one.share, one.key)))


def clear_one(pose: FoundPose, hypotheses: Sequence[Hypothesis]) -> Hypothesis | None:
    """Return the only hypothesis that is plausible; None if several are, or none.

    Without a test it is also None if the pose seems to be another sensor's, or if its names state the other direction.

    Args:
        pose: the numbers.
        hypotheses: what they can mean, the likeliest first.
    """
    first = hypotheses[0]
    tested = not (math.isnan(first.miss_px) and math.isnan(first.apart[0]))
    as_named = not pose.hints.other and not contradicts_names(pose, first)
    return first if first.fits and first.share >= _CLEAR and (tested or as_named) else None


def contradicts_names(pose: FoundPose, hypothesis: Hypothesis) -> bool:
    """Return whether the names around a pose state the other direction than a hypothesis about it."""
    named = pose.hints.named_direction
    return named is not None and all(meaning.direction != named for meaning in hypothesis.meanings)


def likely_ones(hypotheses: Sequence[Hypothesis]) -> Sequence[Hypothesis]:
    """Return those to show to a person: all that are likely, and a few more to compare with."""
    likely = sum(one.share >= _LEAST_SHARE for one in hypotheses)
    return hypotheses[: min(max(likely, _FEWEST), _MOST)]


def _merged(meanings: Iterable[Meaning]) -> list[Hypothesis]:
    """Return the different poses of meanings, each with all of its meanings and their weights added."""
    found: list[tuple[RigidTransform, list[Meaning]]] = []
    ordered = sorted(meanings, key=lambda one: -one.weight)
    rotations = np.zeros((len(ordered), 9))
    translations_m = np.zeros((len(ordered), 3))
    for meaning in ordered:
        pose, count = meaning.camera_from_radar(), len(found)
        turned = np.abs(rotations[:count] - pose.rotation.ravel()).max(axis=1, initial=0.0)
        moved = np.abs(translations_m[:count] - pose.translation_m).max(axis=1, initial=0.0)
        same = np.flatnonzero((turned <= _SAME_RAD) & (moved <= _SAME_M))
        if len(same):
            found[int(same[0])][1].append(meaning)
            continue
        rotations[count], translations_m[count] = pose.rotation.ravel(), pose.translation_m
        found.append((pose, [meaning]))
    return [
        Hypothesis(tuple(group), pose, sum(one.weight for one in group) * mounting_weight(pose))
        for pose, group in found
    ]


def _tested(one: Hypothesis, pairs: CheckPairs | None, against: RigidTransform | None) -> Hypothesis:
    """Return a hypothesis with the figures of its tests."""
    pose, fits = one.camera_from_radar, []
    miss_px, apart = math.nan, (math.nan, math.nan)
    if pairs is not None:
        miss_px = pairs.median_miss_px(pose)
        fits.append(miss_px <= _NEAR_PX * math.hypot(pairs.camera.width_px, pairs.camera.height_px))
    if against is not None:
        distance_m = float(np.linalg.norm(pose.inverse().translation_m - against.inverse().translation_m))
        apart = rotation_angle_rad(pose.rotation @ against.rotation.T), distance_m
        fits.append(apart[0] <= _NEAR_RAD and apart[1] <= _NEAR_M)
    return replace(one, miss_px=miss_px, apart=apart, fits=all(fits) if fits else is_usual(pose))


def _by_pairs(hypotheses: Sequence[Hypothesis], pairs: CheckPairs) -> np.ndarray:
    """Return the log-likelihood of the pairs under each pose (n,), with heavy tails: some pairs may be wrong."""
    misses_px = np.stack([pairs.misses_px(one.camera_from_radar) for one in hypotheses])
    misses_px = np.minimum(misses_px, 1e4)
    sigma_px = max(float(np.median(misses_px, axis=1).min()), _LEAST_SIGMA_PX)
    return np.asarray(-1.5 * np.log1p((misses_px / sigma_px) ** 2 / 2).sum(axis=1))


def _by_distance(one: Hypothesis) -> float:
    angle, distance_m = one.apart
    return -3.0 * (math.log1p((angle / _ANGLE_RAD) ** 2) + math.log1p((distance_m / _APART_M) ** 2))
