"""Export the calibration of a session as `cocalib export --to FORMAT --out FOLDER` does, a ZIP archive as it is."""

from collections.abc import Sequence

from calib_core.errors import InputError
from calib_core.interchange import export
from cocalib.batch.running.solving import SolvedSession

EXPORT_FOLDER = "export"


def export_session(solved: SolvedSession, name: str, taken: Sequence[str]) -> dict[str, bytes]:
    """Return the files of an export by their names in the result.

    Args:
        solved: the session.
        name: of the format.
        taken: names that are in use.

    Raises:
        InputError: the format cannot hold this calibration, or its file has the name of another format's.
    """
    assert solved.found.file is not None
    written = export(solved.found.file, name)
    files = {f"{EXPORT_FOLDER}/{written.file_name}": written.data}
    files |= {f"{EXPORT_FOLDER}/{extra.file_name}": extra.data for extra in written.extra_files}
    for path in sorted(set(files) & set(taken)):
        raise InputError(f"its file {path} is that of another format; export it alone")
    return files
