"""A fleet as its results tell it: sessions with their poses, vehicles with what changed from session to session."""

from dataclasses import dataclass

from calib_core.fleet import SessionPose, Transition
from cocalib.batch.outcome import Outcome
from cocalib.batch.results_folder import UnreadResult

_MOST_NAMED = 5
_NO_POSE_OF = frozenset({"contradictory", "nothing"})


def is_compared(outcome: Outcome) -> bool:
    """Return whether the pose of a result is compared with others: not if its own data contradict it."""
    return outcome.verdict not in _NO_POSE_OF


@dataclass(frozen=True, slots=True, eq=False)
class SessionRecord:
    """One result.

    Attributes:
        outcome: what came of the job.
        place: of the session in the manifest, from 0; None if that is not known.
        pose: of its calibration; None without one.
        pose_problem: why there is none although the session was calibrated, without a full stop.
    """

    outcome: Outcome
    place: int | None = None
    pose: SessionPose | None = None
    pose_problem: str = ""

    @property
    def name(self) -> str:
        """The session's name."""
        return self.outcome.session

    @property
    def compared_pose(self) -> SessionPose | None:
        """The pose to compare with others; None without one, or if its own data contradict it."""
        return self.pose if is_compared(self.outcome) else None

    @property
    def report(self) -> str | None:
        """Where its report is, relative to the folder that holds results/; None without one."""
        named = any(file.name == "report.html" for file in self.outcome.files)
        return f"results/{self.outcome.digest}/report.html" if named else None


@dataclass(frozen=True, slots=True, eq=False)
class VehicleRecord:
    """One vehicle.

    Attributes:
        name: of the vehicle.
        sessions: the latest result of each session, in order of time; at least one.
        transitions: between its successive sessions with a pose, in order.
    """

    name: str
    sessions: tuple[SessionRecord, ...]
    transitions: tuple[Transition, ...] = ()

    @property
    def last(self) -> SessionRecord:
        """The last session."""
        return self.sessions[-1]

    @property
    def calibrated(self) -> SessionRecord | None:
        """The last session with a pose; None if there is none."""
        return next((one for one in reversed(self.sessions) if one.pose is not None), None)

    @property
    def compared(self) -> tuple[SessionPose, ...]:
        """The poses that are compared, in order."""
        return tuple(pose for one in self.sessions if (pose := one.compared_pose) is not None)

    @property
    def vehicle_type(self) -> str | None:
        """Its type, as the last session that names one has it."""
        return next((found for one in reversed(self.sessions) if (found := one.outcome.vehicle_type)), None)

    def transition_to(self, session: str) -> Transition | None:
        """Return the change that ends at a session; None if there is none."""
        return next((one for one in self.transitions if one.after.session == session), None)


@dataclass(frozen=True, slots=True, eq=False)
class FleetRecord:
    """All results of one folder.

    Attributes:
        vehicles: by name.
        superseded: results of sessions that were run again, by vehicle, session and time of the run.
        unread: results that cannot be read.
        missing: sessions that the manifests name and that have no result, as (vehicle, session), in their order.
        unlisted: sessions with a result that no manifest names any more.
        manifests: names of the manifests that were run here; empty if that is not known.
    """

    vehicles: tuple[VehicleRecord, ...]
    superseded: tuple[SessionRecord, ...] = ()
    unread: tuple[UnreadResult, ...] = ()
    missing: tuple[tuple[str, str], ...] = ()
    unlisted: tuple[tuple[str, str], ...] = ()
    manifests: tuple[str, ...] = ()

    @property
    def types(self) -> tuple[str, ...]:
        """The names of the vehicle types, in order."""
        return tuple(sorted({one.vehicle_type for one in self.vehicles if one.vehicle_type}))

    @property
    def shared_serials(self) -> tuple[str, ...]:
        """Which serials the last sessions of several vehicles state, in words: one of them is mistyped, or the sensor moved."""
        said = []
        for sensor in ("radar", "camera"):
            vehicles: dict[str, list[str]] = {}
            for one in self.vehicles:
                serial = getattr(one.last.outcome, f"{sensor}_serial")
                if serial:
                    vehicles.setdefault(serial, []).append(one.name)
            said += [
                f"{sensor} {serial} is in the last sessions of {len(names)} vehicles: {', '.join(names[:_MOST_NAMED])}"
                f"{', …' if len(names) > _MOST_NAMED else ''}; correct the serial, or the manifest of the vehicle it left"
                for serial, names in sorted(vehicles.items())
                if len(names) > 1
            ]
        return tuple(said)

    def of_type(self, vehicle_type: str) -> tuple[VehicleRecord, ...]:
        """Return the vehicles of a type."""
        return tuple(one for one in self.vehicles if one.vehicle_type == vehicle_type)
