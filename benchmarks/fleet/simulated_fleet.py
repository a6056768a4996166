"""Write a simulated fleet: recordings, clicks, a manifest and the truth.

python -m benchmarks.fleet.simulated_fleet OUT --vehicles 50 --sessions 3 --seed 1
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fleet.plan import TAPE_SIGMA_M, FleetPlan, PlannedSession, plan_fleet
from benchmarks.fleet.simulated_session import Mounting
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.synthetic import simulate, write_recording
from calib_core.synthetic.rig import nominal_rotation
from cocalib.batch.engine import Engine, InProcess
from cocalib.batch.worker_processes import WorkerProcesses

__all__ = ["RECORDING", "main", "write_fleet"]

RECORDING = "recording_mcap"


def write_fleet(folder: Path, plan: FleetPlan, engine: Engine) -> Path:
    """Write the files of a fleet and return its manifest.

    Args:
        folder: new or empty.
        plan: what to write.
        engine: writes the recordings.
    """
    folder.mkdir(parents=True, exist_ok=True)
    todo = [(folder, session) for session in plan.sessions]
    for done, _ in enumerate(engine.run_all(_write_session, todo), start=1):
        if done % 10 == 0 or done == len(todo):
            print(f"{done}/{len(todo)} recordings", file=sys.stderr, flush=True)
    (folder / "truth.json").write_text(_truth(plan), encoding="utf-8")
    manifest = folder / "manifest.toml"
    manifest.write_text("\n".join(_table(plan, session) for session in plan.sessions), encoding="utf-8")
    return manifest


def _write_session(folder: Path, session: PlannedSession) -> None:
    target = folder / session.folder
    write_recording(simulate(session.simulation), target, ("mcap",))
    if session.fault == "broken recording":
        for file in (target / RECORDING).glob("*.mcap"):
            size = file.stat().st_size
            file.write_bytes(np.random.default_rng(session.simulation.seed).bytes(size))


def _table(plan: FleetPlan, session: PlannedSession) -> str:
    values: dict[str, Any] = {
        "vehicle": session.vehicle,
        "session": session.session,
        "vehicle_type": plan.vehicle_type,
        "radar_serial": session.radar_serial,
        "camera_serial": session.camera_serial,
        "recording": f"{session.folder}/{RECORDING}",
        "clicks": f"{session.folder}/clicks.json",
        "camera_position_m": session.tape_m.tolist(),
        "camera_position_sigma_m": TAPE_SIGMA_M,
    }
    if session.fault == "no clicks":
        del values["clicks"]
    lines = [f"{key} = {json.dumps(value)}" for key, value in values.items()]  # JSON's strings and lists are TOML's
    return "\n".join(["[[session]]", *lines, ""])


def _truth(plan: FleetPlan) -> str:
    document = {
        "schema": "cocalib/fleet-truth-1",
        "vehicle_type": plan.vehicle_type,
        "mean": _pose(plan.mean),
        "sessions": [
            {
                "vehicle": session.vehicle,
                "session": session.session,
                "radar_serial": session.radar_serial,
                "camera_from_radar": _pose(session.mounting),
                "azimuth_scale": session.simulation.defects.azimuth_scale,
                "elevation_scale": session.simulation.defects.elevation_scale,
                "remounted": session.remounted,
                "fault": session.fault,
            }
            for session in plan.sessions
        ],
    }
    return json.dumps(document, indent=1) + "\n"


def _pose(mounting: Mounting) -> dict[str, Any]:
    rotation = rotation_exp(np.deg2rad(mounting.angles_deg)) @ nominal_rotation()
    camera_from_radar = RigidTransform(rotation, -rotation @ mounting.position_m)
    return {
        "rotation": camera_from_radar.rotation.tolist(),
        "translation_m": camera_from_radar.translation_m.tolist(),
    }


def main(arguments: list[str]) -> int:
    """Write the fleet that the command line asks for."""
    parser = argparse.ArgumentParser(prog="benchmarks.fleet.simulated_fleet", description="Write a simulated fleet.")
    parser.add_argument("out", type=Path, help="folder, new or empty")
    parser.add_argument("--vehicles", type=int, default=50)
    parser.add_argument("--sessions", type=int, default=3)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2, help="processes; 1 writes in this one")
    given = parser.parse_args(arguments)
    engine: Engine = WorkerProcesses(given.workers) if given.workers > 1 else InProcess()
    print(write_fleet(given.out, plan_fleet(given.vehicles, given.sessions, given.seed), engine))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
