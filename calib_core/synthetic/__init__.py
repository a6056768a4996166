"""Truth to test with: scenes, sensors and recordings whose camera_from_radar is known."""

from calib_core.synthetic.pairs import (
    AISLE,
    FIELD,
    NOISE_PROFILES,
    NoiseProfile,
    OutlierMix,
    PairsLayout,
    SimulatedPairs,
    simulate_pairs,
)
from calib_core.synthetic.rig import Rig, RigOptions, random_rig, typical_camera

__all__ = [
    "AISLE",
    "FIELD",
    "NOISE_PROFILES",
    "NoiseProfile",
    "OutlierMix",
    "PairsLayout",
    "Rig",
    "RigOptions",
    "SimulatedPairs",
    "random_rig",
    "simulate_pairs",
    "typical_camera",
]
