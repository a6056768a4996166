"""Simulation: scenes, sensors and recordings with a known camera_from_radar, for tests and benchmarks."""

from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import RadarDefects, SimulationOptions, Surroundings
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.radar_returns import RADAR_PROFILES
from calib_core.synthetic.recording import SimulatedRecording, simulate
from calib_core.synthetic.rig import Rig, RigOptions, random_rig, typical_camera
from calib_core.synthetic.simulated_pairs import (
    AISLE,
    FIELD,
    NOISE_PROFILES,
    PairsLayout,
    SimulatedPairs,
    SystematicErrors,
    draw_systematic_errors,
    simulate_pairs,
)

__all__ = [
    "AISLE",
    "FIELD",
    "NOISE_PROFILES",
    "PRESETS",
    "RADAR_PROFILES",
    "PairsLayout",
    "PresetName",
    "RadarDefects",
    "Rig",
    "RigOptions",
    "SimulatedPairs",
    "SimulatedRecording",
    "SimulationOptions",
    "Surroundings",
    "SystematicErrors",
    "draw_systematic_errors",
    "random_rig",
    "simulate",
    "simulate_pairs",
    "typical_camera",
    "write_recording",
]
