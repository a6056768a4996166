"""`cocalib batch`: calibrate the sessions of a manifest."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.exit_codes import batch_exit_code
from cocalib.cli.flags import File, Folder, Require, Switch, called
from cocalib.cli.fleet import ACTIONS, fleet
from cocalib.cli.output import progress_bar, write_whole

if TYPE_CHECKING:
    from cocalib.batch.manifest import Manifest
    from cocalib.batch.outcome import Outcome


@dataclass(frozen=True, slots=True)
class Batch:
    """Calibrate many sessions, finished ones are skipped; status, history, compare, summary: what their results say.

    `batch status OUT`: where each vehicle stands. `batch history VEHICLE OUT`: its sessions and what changed in between.
    `batch compare A B OUT`: two sessions VEHICLE/SESSION, or two vehicles of one type. `batch summary OUT`: write
    OUT/summary.html. `batch export OUT --csv FILE`: all sessions as a table. OUT is the folder that batch wrote to.
    """

    given: Annotated[tuple[str, ...], tyro.conf.Positional, called("MANIFEST|ACTION...")] = ()
    """Sessions to calibrate (.toml), or an action: status OUT, history VEHICLE OUT, compare A B OUT, summary OUT, export OUT."""
    out: Folder = None
    """Folder for the results; beside the manifest, with its name, unless given."""
    init: Folder = None
    """Write the manifest from the recordings in this folder, for you to complete, and calibrate nothing."""
    workers: Annotated[int | None, called("N")] = None
    """Worker processes on this machine; 1: this process does the work; one per processor for many sessions, unless given."""
    require: Require = None
    """Count sessions below this verdict as failed in the exit code."""
    json: Switch = False
    """With status, history, compare: print one JSON object instead of text."""
    csv: File = None
    """With export: CSV file to write."""
    scheduler: Annotated[str | None, called("ADDRESS")] = None
    """Address of your own Dask scheduler, such as tls://host:8786 (needs cocalib[cluster]); who reaches it can run code."""

    def run(self) -> int:
        """Calibrate, print a table of what came of it; return the exit code."""
        if not self.given:
            raise InputError("MANIFEST is missing; see cocalib batch --help")
        action, *names = self.given
        if action in ACTIONS:
            if Batch(given=self.given, json=self.json, csv=self.csv) != self:
                raise InputError(f"batch {action} takes --json or --csv only; see cocalib batch --help")
            return fleet(action, names, json=self.json, csv=self.csv)
        if names or self.json or self.csv is not None:
            raise InputError(f"batch takes one MANIFEST, or an action: {', '.join(ACTIONS)}; see cocalib batch --help")
        manifest = Path(action)
        if self.init is not None:
            return self._write_first(manifest, self.init)
        from cocalib.batch.manifest import read_manifest

        return self._calibrate(read_manifest(manifest))

    def _write_first(self, manifest: Path, folder: Path) -> int:
        """Write a first manifest, never over another file."""
        from cocalib.batch.first_manifest import first_manifest

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
        from cocalib.batch.driving import chosen_engine, drive
        from cocalib.batch.job import jobs_of
        from cocalib.batch.plan import write_plan
        from cocalib.batch.results_folder import ResultsFolder
        from cocalib.cli.batch_text import batch_lines, shown_batch
        from cocalib.fleet.reading import read_fleet
        from cocalib.fleet.summary_page import write_summary

        results = ResultsFolder(self.out or manifest.source.with_suffix(""))
        try:
            warnings: list[str] = []
            engine = chosen_engine(
                len(manifest.rows), workers=self.workers, scheduler=self.scheduler, tell=warnings.append
            )
            with progress_bar("reading recordings") as progress_bytes:
                jobs = jobs_of(manifest.rows, results.path, progress_bytes)
            write_plan(results.path, manifest.source, jobs)
            with shown_batch(len(jobs)) as show:
                outcomes = drive(jobs, engine, results, show)
            for warning in warnings:
                print(f"warning: {warning}", file=sys.stderr)
            if results.digests():
                write_summary(results.path, read_fleet(results.path))
        except OSError as error:
            raise InputError(f"{results.path}: cannot be written: {error.strerror or error}") from error
        print("\n".join([*batch_lines(outcomes), "", _next_line(results.path)]))
        return batch_exit_code([_level(one) for one in outcomes], self.require)


def _level(outcome: "Outcome") -> str | None:
    """Return the level of the verdict on a session's calibration; None without one."""
    return (outcome.verdict or "nothing") if outcome.status in ("solved", "weak") else None


def _next_line(results: Path) -> str:
    """Say where the results are, and what comes next."""
    from cocalib.fleet.summary_page import SUMMARY_FILE

    return f"results: {results}; summary: {results / SUMMARY_FILE}; which vehicles need attention: cocalib batch status {results}"
