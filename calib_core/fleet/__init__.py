"""A fleet: what was remounted, how the mountings of a vehicle type scatter, and which vehicle is unlike its type."""

from calib_core.fleet.mounting_scatter import LeftOut, MountingScatter, OffKind, mounting_scatter, off_kind, off_kinds
from calib_core.fleet.mountings import (
    Mounting,
    RelevantChange,
    Transition,
    mounting_of,
    mountings_of,
    transition,
    transitions_of,
)
from calib_core.fleet.session_pose import SessionPose, session_pose

__all__ = [
    "LeftOut",
    "Mounting",
    "MountingScatter",
    "OffKind",
    "RelevantChange",
    "SessionPose",
    "Transition",
    "mounting_of",
    "mounting_scatter",
    "mountings_of",
    "off_kind",
    "off_kinds",
    "session_pose",
    "transition",
    "transitions_of",
]
