"""Simulation: scenes, sensors and recordings with a known camera_from_radar, for tests and benchmarks."""

from calib_core.synthetic.annotations import true_boxes, true_labels
from calib_core.synthetic.clicking import SimulatedClick
from calib_core.synthetic.files import write_recording
from calib_core.synthetic.options import (
    Clicking,
    Clutter,
    Container,
    IntrinsicsErrors,
    OtherCamera,
    RadarDefects,
    RadarMessage,
    RadarName,
    SceneName,
    SimulationOptions,
    Surroundings,
    Traffic,
    WavedBoard,
)
from calib_core.synthetic.presets import PRESETS, PresetName
from calib_core.synthetic.radar_returns import RADAR_PROFILES, RadarProfile
from calib_core.synthetic.recording import SimulatedFrame, SimulatedRecording, simulate
from calib_core.synthetic.rig import Rig, RigOptions, random_rig, typical_camera
from calib_core.synthetic.scans import SimulatedScans, simulate_scans
from calib_core.synthetic.scene.stage import SimulatedPlacement
from calib_core.synthetic.simulated_pairs import (
    AISLE,
    FIELD,
    NOISE_PROFILES,
    OutlierMix,
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
    "Clicking",
    "Clutter",
    "Container",
    "IntrinsicsErrors",
    "OtherCamera",
    "OutlierMix",
    "PairsLayout",
    "PresetName",
    "RadarDefects",
    "RadarMessage",
    "RadarName",
    "RadarProfile",
    "Rig",
    "RigOptions",
    "SceneName",
    "SimulatedClick",
    "SimulatedFrame",
    "SimulatedPairs",
    "SimulatedPlacement",
    "SimulatedRecording",
    "SimulatedScans",
    "SimulationOptions",
    "Surroundings",
    "SystematicErrors",
    "Traffic",
    "WavedBoard",
    "draw_systematic_errors",
    "random_rig",
    "simulate",
    "simulate_pairs",
    "simulate_scans",
    "true_boxes",
    "true_labels",
    "typical_camera",
    "write_recording",
]
