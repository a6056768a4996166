"""The truth about a simulated fleet, read from its truth.json."""

import json
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from calib_core.geometry import RigidTransform

__all__ = ["FleetTruth", "TrueSession", "read_truth"]

_WRONG_RADARS = ("mirrored radar", "radar of another type")


@dataclass(frozen=True, slots=True)
class TrueSession:
    """One session.

    Attributes:
        vehicle: its name.
        session: its name.
        remounted: the camera was mounted again since the session before.
        fault: what is wrong; None if nothing is.
        camera_from_radar: the true pose.
    """

    vehicle: str
    session: str
    remounted: bool
    fault: str | None
    camera_from_radar: RigidTransform

    @property
    def name(self) -> str:
        """Vehicle and session."""
        return f"{self.vehicle}/{self.session}"


@dataclass(frozen=True, slots=True)
class FleetTruth:
    """All sessions, vehicle by vehicle, in order of time."""

    sessions: tuple[TrueSession, ...]

    @property
    def remounted(self) -> tuple[TrueSession, ...]:
        """The sessions before which the camera was mounted again."""
        return tuple(one for one in self.sessions if one.remounted)

    @property
    def wrong_radars(self) -> frozenset[str]:
        """The vehicles that have a wrong radar."""
        return frozenset(one.vehicle for one in self.sessions if one.fault in _WRONG_RADARS)

    @property
    def healthy(self) -> frozenset[str]:
        """Names of the sessions without a fault before any remount of their vehicle."""
        after = {
            later.name
            for one in self.remounted
            for later in self._of(one.vehicle)[self._place(one.vehicle, one.session) :]
        }
        return frozenset(one.name for one in self.sessions if one.fault is None) - after

    def remounts_between(self, vehicle: str, before: str, after: str) -> tuple[str, ...]:
        """Return the sessions after one session, up to another of the same vehicle, before which it was remounted."""
        rows = self._of(vehicle)[self._place(vehicle, before) + 1 : self._place(vehicle, after) + 1]
        return tuple(one.session for one in rows if one.remounted)

    def _of(self, vehicle: str) -> list[TrueSession]:
        return [one for one in self.sessions if one.vehicle == vehicle]

    def _place(self, vehicle: str, session: str) -> int:
        return len(list(takewhile(lambda one: one.session != session, self._of(vehicle))))


def read_truth(fleet: Path) -> FleetTruth:
    """Read the truth of a fleet from its folder."""
    rows = json.loads((fleet / "truth.json").read_text(encoding="utf-8"))["sessions"]
    return FleetTruth(tuple(_session(one) for one in rows))


def _session(row: dict[str, Any]) -> TrueSession:
    pose = row["camera_from_radar"]
    camera_from_radar = RigidTransform(np.array(pose["rotation"]), np.array(pose["translation_m"]))
    return TrueSession(row["vehicle"], row["session"], row["remounted"], row["fault"], camera_from_radar)
