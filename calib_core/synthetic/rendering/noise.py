"""Seeded noise and filtered patterns on surfaces, with nothing finer than a pixel's footprint, to avoid shimmering."""

import numpy as np


def hash_random(i: np.ndarray, j: np.ndarray, seed: int) -> np.ndarray:
    """Return a number in 0 to 1 for each pair of integers, the same one every time."""
    with np.errstate(over="ignore"):
        h = i.astype(np.uint32) * np.uint32(0x9E3779B1) ^ j.astype(np.uint32) * np.uint32(0x85EBCA77)
        h = (h ^ np.uint32(seed * 0x27D4EB2F & 0xFFFFFFFF)) * np.uint32(0xC2B2AE3D)
        h = (h ^ (h >> np.uint32(15))) * np.uint32(0x2C1B3C6D)
        h ^= h >> np.uint32(13)
    return (h & np.uint32(0xFFFFFF)).astype(np.float32) / np.float32(0x1000000)


def cell_random(u: np.ndarray, v: np.ndarray, seed: int) -> np.ndarray:
    """Return a number in 0 to 1 that is constant within each unit cell."""
    return hash_random(np.floor(u).astype(np.int32), np.floor(v).astype(np.int32), seed)


def value_noise(u: np.ndarray, v: np.ndarray, seed: int) -> np.ndarray:
    """Return smooth noise in -1 to 1 with features one unit apart."""
    i, j = np.floor(u).astype(np.int32), np.floor(v).astype(np.int32)
    s, t = (u - i).astype(np.float32), (v - j).astype(np.float32)
    s, t = s * s * (3.0 - 2.0 * s), t * t * (3.0 - 2.0 * t)
    low = hash_random(i, j, seed) * (1.0 - s) + hash_random(i + 1, j, seed) * s
    high = hash_random(i, j + 1, seed) * (1.0 - s) + hash_random(i + 1, j + 1, seed) * s
    return 2.0 * (low * (1.0 - t) + high * t) - 1.0


def fractal_noise(
    u_m: np.ndarray,
    v_m: np.ndarray,
    *,
    size_m: float,
    octaves: int,
    footprint_m: np.ndarray,
    seed: int,
    fall: float = 0.6,
) -> np.ndarray:
    """Add octaves of noise, leaving out what is finer than a pixel.

    Args:
        u_m, v_m: where on the surface [m].
        size_m: feature size of the coarsest octave [m].
        octaves: how many, each half the size of the previous one.
        footprint_m: size of a pixel on the surface [m].
        seed: of the pattern.
        fall: amplitude of an octave relative to the previous one.
    """
    total = np.zeros(np.shape(u_m), dtype=np.float32)
    for octave in range(octaves):
        size = size_m / 2.0**octave
        visible = np.clip(size / (2.0 * footprint_m) - 0.5, 0.0, 1.0)
        if float(visible.max(initial=0.0)) <= 0.0:
            break
        total += fall**octave * visible * value_noise(u_m / size, v_m / size, seed + octave)
    return total


def line_coverage(position_m: np.ndarray, *, period_m: float, width_m: float, footprint_m: np.ndarray) -> np.ndarray:
    """Return the share of a pixel covered by repeating lines: 0 to 1, box-filtered.

    Args:
        position_m: across the lines; one is centred on 0 [m].
        period_m: their distance [m].
        width_m: their width [m].
        footprint_m: size of a pixel across them [m].
    """
    half = np.maximum(0.5 * footprint_m, 1e-5)

    def integral(x: np.ndarray) -> np.ndarray:
        whole = np.floor(x / period_m)
        return whole * width_m + np.minimum(x - whole * period_m, width_m)

    shifted = position_m + 0.5 * width_m
    return (integral(shifted + half) - integral(shifted - half)) / (2.0 * half)
