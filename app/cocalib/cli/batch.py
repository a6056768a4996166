"""`cocalib batch`: calibrate the sessions of a manifest."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from calib_core.errors import InputError
from cocalib.cli.exit_codes import DONE, IN_DOUBT, batch_exit_code
from cocalib.cli.flags import INPUT, OutFile, OutFolder, Output, OutputFlags, Require, Switch, called
from cocalib.platform.files import require_writable, write_whole
from cocalib.platform.terminal import print_exactly

if TYPE_CHECKING:
    from cocalib.batch.manifest import Manifest
    from cocalib.batch.outcome import Outcome


@dataclass(frozen=True, slots=True)
class Batch:
    """Calibrate many sessions, finished ones are skipped; batch status: what came of each.

    OUT/results.csv and OUT/results.json have a row for each session; `batch status OUT` prints them as a table. Exit code 3: one
    has no calibration, or one in doubt.
    """

    given: Annotated[tuple[str, ...], tyro.conf.Positional, called("MANIFEST|status OUT"), INPUT] = ()
    """Sessions to calibrate (.toml); or status and the folder that batch wrote to."""
    out: OutFolder = None
    """Folder for the results; beside the manifest, with its name, unless given."""
    workers: Annotated[int | None, called("N")] = None
    """Worker processes on this machine; 1: this process does the work; one per processor for many sessions, unless given."""
    require: Require = None
    """Count sessions below this verdict as failed in the exit code."""
    json: Switch = False
    """With status: print one JSON object instead of text."""
    csv: OutFile = None
    """With status: CSV file to write instead of printing the table."""
    scheduler: Annotated[str | None, called("ADDRESS")] = None
    """Address of your own Dask scheduler, such as tls://host:8786 (needs cocalib[cluster]); who reaches it can run code."""
    output: Output = field(default_factory=OutputFlags)

    def run(self) -> int:
        """Calibrate, print a table of what came of it; return the exit code."""
        if not self.given:
            raise InputError("MANIFEST is missing; see cocalib batch --help")
        first, *others = self.given
        if first == "status":
            return self._status(others)
        if others or self.json or self.csv is not None:
            raise InputError("batch takes one MANIFEST, or status OUT; see cocalib batch --help")
        from cocalib.batch.manifest import read_manifest

        return self._calibrate(read_manifest(Path(first)))

    def _status(self, folders: Sequence[str]) -> int:
        """Show the results of a folder; return 0 if all sessions are solved and none is in doubt."""
        from cocalib.batch.results_table import csv_bytes, json_bytes, read_results
        from cocalib.cli.batch_text import status_lines

        taken = Batch(given=self.given, json=self.json, csv=self.csv, output=self.output)
        if taken != self or (self.json and self.csv is not None):
            raise InputError("batch status takes --json or --csv FILE only; see cocalib batch --help")
        if len(folders) != 1:
            raise InputError(f"batch status takes OUT, the folder that batch wrote to; {len(folders)} given")
        folder = Path(folders[0])
        if not folder.is_dir():
            raise InputError(f"{folder}: no such folder; give the one that batch wrote to")
        table = read_results(folder)
        if self.json:
            print_exactly(json_bytes(table).decode())
        elif self.csv is not None:
            write_whole(self.csv, csv_bytes(table))
            print(f"{self.csv} written", file=sys.stderr)
        else:
            print("\n".join(status_lines(table)))
        return DONE if table.all_solved else IN_DOUBT

    def _calibrate(self, manifest: "Manifest") -> int:
        from cocalib.batch.driving import chosen_engine, drive
        from cocalib.batch.job import job_of
        from cocalib.batch.plan import write_plan
        from cocalib.batch.results_folder import ResultsFolder
        from cocalib.batch.results_table import CSV_FILE, JSON_FILE, read_results, write_results
        from cocalib.cli.batch_text import batch_lines, shown_batch

        results = ResultsFolder(self.out or manifest.source.with_suffix(""))
        if results.path.is_dir():
            require_writable(results.path / CSV_FILE)
            require_writable(results.path / JSON_FILE)
        try:
            warnings: list[str] = []
            engine = chosen_engine(
                len(manifest.rows), workers=self.workers, scheduler=self.scheduler, tell=warnings.append
            )
            jobs = tuple(map(job_of, manifest.rows))
            write_plan(results.path, manifest.source, jobs)
            with shown_batch(len(jobs)) as show:
                outcomes = drive(jobs, engine, results, show)
            for warning in warnings:
                print(f"warning: {warning}", file=sys.stderr)
            write_results(results.path, read_results(results.path))
        except OSError as error:
            raise InputError(f"{results.path}: cannot be written: {error.strerror or error}") from error
        print("\n".join(batch_lines(outcomes)))
        print(f"\nresults: {results.path / CSV_FILE}, {results.path / JSON_FILE}")
        print(f"as a table: cocalib batch status {results.path}")
        return batch_exit_code([_level(outcome) for outcome in outcomes], self.require)


def _level(outcome: "Outcome") -> str | None:
    """Return the level of the verdict on a session's calibration; None without one."""
    return (outcome.verdict or "nothing") if outcome.status in ("solved", "weak") else None
