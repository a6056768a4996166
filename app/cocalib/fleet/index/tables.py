"""The tables of the index, its version, and how a connection to it is opened."""

import sqlite3
from pathlib import Path
from typing import Final

from calib_core.errors import InputError

INDEX_FILE: Final = "fleet.sqlite"
INDEX_VERSION: Final = 4
"""SQLite's user_version. It counts up with every change of the tables."""

_PATIENCE_S = 30.0
_TABLES = """
CREATE TABLE sessions (
    digest TEXT PRIMARY KEY, vehicle TEXT NOT NULL, session TEXT NOT NULL, place INTEGER,
    wanted INTEGER NOT NULL, position INTEGER, superseded INTEGER NOT NULL DEFAULT 0,
    status TEXT NOT NULL, reason TEXT NOT NULL, verdict TEXT, vehicle_type TEXT, radar_serial TEXT, camera_serial TEXT,
    recorded_ns INTEGER, sigma_deg REAL, sigma_cm REAL, aed_px REAL, pairs INTEGER NOT NULL, started TEXT,
    pose_problem TEXT NOT NULL, outcome TEXT NOT NULL
) WITHOUT ROWID;
CREATE INDEX sessions_of_vehicle ON sessions (vehicle, session);
CREATE TABLE poses (
    digest TEXT PRIMARY KEY REFERENCES sessions ON DELETE CASCADE,
    rotation TEXT NOT NULL, translation_m TEXT NOT NULL, covariance TEXT NOT NULL, systematic TEXT NOT NULL,
    quantile REAL NOT NULL, reference_radar_m TEXT, camera TEXT, angle_scales TEXT NOT NULL,
    measured TEXT, of_tape TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE transitions (
    after TEXT PRIMARY KEY REFERENCES sessions ON DELETE CASCADE, before TEXT NOT NULL REFERENCES sessions ON DELETE CASCADE,
    outcome TEXT NOT NULL, rotation_deg REAL NOT NULL, rotation_sigma_deg REAL, position_cm REAL NOT NULL,
    position_sigma_cm REAL, picture_px REAL, picture_sigma_px REAL, squared REAL NOT NULL, squared_limit REAL NOT NULL,
    resolved_deg REAL NOT NULL, resolved_cm REAL NOT NULL, change TEXT NOT NULL, covariance TEXT NOT NULL, words TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE files (
    digest TEXT NOT NULL REFERENCES sessions ON DELETE CASCADE, name TEXT NOT NULL, sha256 TEXT NOT NULL,
    PRIMARY KEY (digest, name)
) WITHOUT ROWID;
"""


def index_path(folder: Path) -> Path:
    """Return where the index of a folder with results is."""
    return folder / INDEX_FILE


def create_tables(connection: sqlite3.Connection) -> None:
    """Create the tables in an empty file."""
    connection.executescript(f"BEGIN;{_TABLES}PRAGMA user_version = {INDEX_VERSION};COMMIT;")


def read_only(path: Path) -> sqlite3.Connection:
    """Open an index for reading only; a writer that is at work is waited for.

    Raises:
        sqlite3.Error: it cannot be opened.
    """
    address = f"{path.resolve().as_uri()}?mode=ro"
    return sqlite3.connect(address, uri=True, timeout=_PATIENCE_S, isolation_level=None)


def writable(path: Path) -> sqlite3.Connection:
    """Open an index for writing, or create the file.

    The journal is a file that is deleted with each commit, not a write-ahead log: that needs shared memory, which drives on
    a network do not have.

    Raises:
        sqlite3.Error: it cannot be opened.
    """
    connection = sqlite3.connect(path, timeout=_PATIENCE_S, isolation_level=None)
    connection.execute("PRAGMA journal_mode = DELETE")
    connection.execute("PRAGMA foreign_keys = ON")
    return connection


def has_tables(connection: sqlite3.Connection) -> bool:
    """Return whether the file holds any table yet."""
    return connection.execute("SELECT count(*) FROM sqlite_master").fetchone() != (0,)


def require_version(connection: sqlite3.Connection, path: Path) -> None:
    """Refuse the index of another version.

    Raises:
        InputError: it is of another version.
        sqlite3.Error: it cannot be read.
    """
    (found,) = connection.execute("PRAGMA user_version").fetchone()
    if found != INDEX_VERSION:
        raise InputError(
            f"{path}: an index of version {found}, and this program reads version {INDEX_VERSION}; "
            f"write it again from the results, which are not changed: cocalib fleet rebuild {path.parent}"
        )


def damaged(path: Path, error: Exception) -> InputError:
    """Return the error about an index that SQLite cannot read, or whose rows another version wrote."""
    return InputError(
        f"{path}: cannot be read as an index: {error}; write it again from the results, which are not changed: "
        f"cocalib fleet rebuild {path.parent}"
    )
