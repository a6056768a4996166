"""`cocalib batch`: calibrate the sessions of a manifest."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.flags import Folder, called
from cocalib.cli.output import progress_bar, write_whole

if TYPE_CHECKING:
    from cocalib.batch.driving import BatchProgress
    from cocalib.batch.manifest import Manifest
    from cocalib.batch.results_folder import ResultsFolder


@dataclass(frozen=True, slots=True)
class Batch:
    """Calibrate many sessions: solve, evaluate, report and export each; what is done already is not done again.

    Exit code 0: all are solved; 3: some only weakly; 11 to 99: 10 and how many have no calibration, at most 89 counted.
    """

    manifest: Annotated[Path | None, tyro.conf.Positional, called("MANIFEST")] = None
    """Sessions to calibrate (.toml): vehicle, session, recording, clicks or auto, camera, options."""
    out: Folder = None
    """Folder for the results; beside the manifest, with its name, unless given."""
    init: Folder = None
    """Write the manifest from the recordings in this folder, for you to complete, and calibrate nothing."""
    workers: Annotated[int | None, called("N")] = None
    """Worker processes on this machine; 1: this process does the work; one per processor for many sessions, unless given."""
    scheduler: Annotated[str | None, called("ADDRESS")] = None
    """Address of your own Dask scheduler, such as tls://host:8786 (needs cocalib[fleet]); who reaches it can run code."""
    shard: Annotated[str | None, called("K/N")] = None
    """Calibrate only the K-th of N parts, for SLURM, make or GNU parallel; all parts may share one folder of results."""

    def run(self) -> int:
        """Calibrate, print a table of what came of it; return the exit code."""
        if self.manifest is None:
            raise InputError("MANIFEST is missing; see cocalib batch --help")
        if self.init is not None:
            return self._write_first(self.manifest, self.init)
        from cocalib.batch.manifest_files.reading import read_manifest

        return self._calibrate(read_manifest(self.manifest))

    def _write_first(self, manifest: Path, folder: Path) -> int:
        """Write a first manifest, never over another file."""
        from cocalib.batch.manifest_files.first_manifest import first_manifest

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

    def _calibrate(self, manifest: "Manifest") -> int:
        from cocalib.batch.driving import chosen_engine, drive, shard_of
        from cocalib.batch.fleet_priors import require_priors_of_others
        from cocalib.batch.job import jobs_of
        from cocalib.batch.plan import write_plan
        from cocalib.batch.results_folder import ResultsFolder
        from cocalib.cli.fleet.batch_text import batch_lines, exit_code, shown_batch

        shard = None if self.shard is None else _shard(self.shard)
        require_priors_of_others(manifest)
        results = ResultsFolder(self.out or manifest.source.with_suffix(""))
        try:
            with progress_bar("reading recordings") as progress_bytes:
                jobs = jobs_of(manifest.rows, results.path, progress_bytes)
            write_plan(results.path, manifest.source, jobs)
            jobs = jobs if shard is None else shard_of(jobs, *shard)
            engine = chosen_engine(len(jobs), workers=self.workers, scheduler=self.scheduler)
            with shown_batch(len(jobs)) as show, self._indexed(results) as add:

                def tell(now: "BatchProgress") -> None:
                    show(now)
                    add(now)

                outcomes = drive(jobs, engine, results, tell)
        except OSError as error:
            raise InputError(f"{results.path}: cannot be written: {(error.strerror or str(error)).lower()}") from error
        print("\n".join([*batch_lines(outcomes), *self._next_lines(results.path)]))
        return exit_code(outcomes)

    @contextmanager
    def _indexed(self, results: "ResultsFolder") -> "Iterator[Callable[[BatchProgress], None]]":
        """Keep index and summary page meanwhile; parts of a batch leave them to one process afterwards."""
        from cocalib.fleet.batch_index import indexed_batch

        if self.shard is not None:
            yield lambda _: None
            return
        with indexed_batch(results.path) as add:
            yield add

    def _next_lines(self, results: Path) -> list[str]:
        """Say where the results are, and what comes next."""
        from cocalib.fleet.summary_page import SUMMARY_FILE

        if self.shard is not None:
            return ["", f"results: {results}; once all parts are done: cocalib fleet rebuild {results}"]
        return [
            "",
            f"results: {results}; summary: {results / SUMMARY_FILE}; who needs a look: cocalib fleet status {results}",
        ]


def _shard(text: str) -> tuple[int, int]:
    """Return number and count of `K/N`.

    Raises:
        InputError: it is something else.
    """
    k, slash, n = text.partition("/")
    if not (slash and k.isdecimal() and n.isdecimal()):
        raise InputError(f"--shard {text}: write the number of the part and how many there are, such as 3/16")
    return int(k), int(n)
