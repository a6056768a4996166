"""Write the index: by the process that drives the batch, one result at a time, or all of it again from the results."""

import sqlite3
from pathlib import Path
from types import TracebackType
from typing import Self

from calib_core.errors import InputError
from cocalib.batch.outcome import Outcome
from cocalib.batch.plan import read_plans
from cocalib.fleet.index.filling import Places, fill, put, set_places
from cocalib.fleet.index.result_reading import finished_results
from cocalib.fleet.index.tables import create_tables, damaged, has_tables, index_path, require_version, writable
from cocalib.fleet.records import UnreadResult
from cocalib.platform.files import whole_path


class FleetIndex:
    """The index of a folder with results, open for writing by the one process that drives the batch.

    Opening it brings it up to date with the results that lie there. A process that is killed leaves an index that can be read,
    and that the next one continues.
    """

    def __init__(self, folder: Path) -> None:
        """Open or create the index.

        Args:
            folder: holds the results, and what the manifests want.

        Raises:
            InputError: the index is of another version, or is damaged.
            OSError: it cannot be written.
        """
        self._folder = folder
        self._places: Places = read_plans(folder).sessions
        folder.mkdir(parents=True, exist_ok=True)
        path = index_path(folder)
        try:
            self._connection = writable(path)
            if not has_tables(self._connection):
                create_tables(self._connection)
            require_version(self._connection, path)
            self.unread = self._catch_up()
        except sqlite3.OperationalError as error:
            raise _not_written(path, error) from error
        except (sqlite3.DatabaseError, ValueError) as error:  # msgspec's and json's errors are ValueErrors
            raise damaged(path, error) from error

    def add(self, outcome: Outcome) -> None:
        """Add a result whose folder is complete; one of the same job is replaced.

        Raises:
            InputError: the index cannot be written.
        """
        try:
            with _Transaction(self._connection):
                put(self._connection, self._folder, outcome, self._places)
        except sqlite3.Error as error:
            raise _not_written(index_path(self._folder), error) from error

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _catch_up(self) -> tuple[UnreadResult, ...]:
        with _Transaction(self._connection):
            set_places(self._connection, self._places)
            return fill(self._connection, self._folder, finished_results(self._folder), self._places)


def rebuild_index(folder: Path) -> tuple[UnreadResult, ...]:
    """Write the index again from the results; readers find the old one or the new one.

    Args:
        folder: holds the results, and what the manifests want.

    Returns:
        The results that cannot be read, and are not in the index.

    Raises:
        InputError: there are no results.
        OSError: the index cannot be written.
    """
    finished = finished_results(folder)
    if not finished:
        raise InputError(f"{folder}: no results in {folder / 'results'}; give the folder that cocalib batch wrote to")
    places = read_plans(folder).sessions
    path = index_path(folder)
    try:
        with whole_path(path) as unfinished:
            connection = writable(unfinished)
            try:
                create_tables(connection)
                with _Transaction(connection):
                    unread = fill(connection, folder, finished, places)
            finally:
                connection.close()
            Path(f"{path}-journal").unlink(missing_ok=True)  # of a killed writer: it belongs to the old file
    except sqlite3.Error as error:
        raise _not_written(path, error) from error
    return unread


class _Transaction:
    """All changes of a block, or none."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def __enter__(self) -> None:
        self._connection.execute("BEGIN IMMEDIATE")

    def __exit__(self, kind: type[BaseException] | None, _: BaseException | None, __: TracebackType | None) -> None:
        try:
            if kind is None:
                self._connection.execute("COMMIT")
        finally:
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")


def _not_written(path: Path, error: sqlite3.Error) -> InputError:
    return InputError(
        f"{path}: cannot be written: {error}; check the permissions and the free space, and that no other batch writes there"
    )
