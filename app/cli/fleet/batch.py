"""`cocalib batch`: calibrate the sessions of a manifest."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from app.cli.flags import Folder, called
from app.cli.output import write_whole
from calib_core.errors import InputError

if TYPE_CHECKING:
    from app.batch.engines.engine import Engine
    from app.batch.job import Job
    from app.batch.manifest import Manifest

__all__ = ["Batch"]


@dataclass(frozen=True, slots=True)
class Batch:
    """Calibrate many sessions: solve, evaluate, report and export each; what is done already is not done again.

    Exit code 0: all are solved; 3: some only weakly; 11 to 99: 10 and how many have no calibration, at most 89 counted.
    """

    manifest: Annotated[Path | None, tyro.conf.Positional, called("MANIFEST")] = None
    """Sessions to calibrate (.toml or .csv): vehicle, session, recording, clicks or auto, camera, options."""
    out: Folder = None
    """Folder for the results; beside the manifest, with its name, unless given."""
    init: Folder = None
    """Write the manifest from the recordings in this folder, for you to complete, and calibrate nothing."""
    workers: Annotated[int | None, called("N")] = None
    """Worker processes on this machine (needs cocalib[fleet])."""
    scheduler: Annotated[str | None, called("ADDRESS")] = None
    """Address of a Dask scheduler that exists, such as tls://host:8786 (needs cocalib[fleet])."""
    engine: Annotated[Literal["auto", "none", "dask"], tyro.conf.arg(help_behavior_hint="")] = "auto"
    """none: one session after the other in this process; dask: worker processes; auto: dask for many sessions, if installed."""
    shard: Annotated[str | None, called("K/N")] = None
    """Calibrate only the K-th of N parts, for SLURM, make or GNU parallel; all parts may share one folder of results."""

    def run(self) -> int:
        """Calibrate, print a table of what came of it; return the exit code."""
        if self.manifest is None:
            raise InputError("MANIFEST is missing; see cocalib batch --help")
        if self.init is not None:
            return self._write_first(self.manifest, self.init)
        from app.batch.manifest_files.reading import read_manifest

        self._require_one_engine()
        return self._calibrate(read_manifest(self.manifest))

    def _write_first(self, manifest: Path, folder: Path) -> int:
        """Write a first manifest, never over another file."""
        from app.batch.manifest_files.first_manifest import first_manifest

        if manifest.suffix.lower() != ".toml":
            raise InputError(f"{manifest}: --init writes a .toml file; name it so")
        if manifest.exists():
            raise InputError(f"{manifest}: exists already; name another file, or move it away")
        text, count = first_manifest(folder, manifest)
        write_whole(manifest, text)
        print(
            f"{count} session{'' if count == 1 else 's'} written to {manifest}: complete it, then cocalib batch {manifest}"
        )
        return 0

    def _require_one_engine(self) -> None:
        """Refuse flags that contradict each other.

        Raises:
            InputError: names both.
        """
        if self.workers is not None and self.scheduler is not None:
            raise InputError(
                "--workers starts a cluster on this machine, --scheduler uses another one; give one of them"
            )
        if self.engine == "none" and (self.workers is not None or self.scheduler is not None):
            raise InputError("--engine none runs in this process; leave out --workers and --scheduler")
        if self.workers is not None and self.workers < 1:
            raise InputError(f"--workers {self.workers}: give one worker process or more")

    def _calibrate(self, manifest: "Manifest") -> int:
        from app.batch.driving import drive
        from app.batch.results_folder import ResultsFolder
        from app.cli.fleet.batch_text import batch_lines, exit_code, shown_batch

        results = ResultsFolder(self.out or manifest.source.with_suffix(""))
        jobs = _jobs(manifest)
        with shown_batch(len(jobs)) as progress:
            outcomes = drive(jobs, self._engine(len(jobs)), results, progress)
        print("\n".join(batch_lines(outcomes)))
        return exit_code(outcomes)

    def _engine(self, count: int) -> "Engine":
        from app.batch.engines.dask_cluster import DaskCluster
        from app.batch.engines.in_process import InProcess

        if self.workers is not None or self.scheduler is not None or self.engine == "dask":
            return DaskCluster(self.workers, self.scheduler)
        return InProcess()


def _jobs(manifest: "Manifest") -> "tuple[Job, ...]":
    import hashlib

    from app.batch.job import job_of

    return tuple(job_of(row, lambda path: hashlib.sha256(path.read_bytes()).hexdigest()) for row in manifest.rows)
