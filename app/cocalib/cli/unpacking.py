"""Write the files of a zip archive into a folder, without replacing a file that is not theirs."""

from pathlib import Path

from calib_core.errors import InputError
from calib_core.interchange.syntax.zip_archives import unpack
from cocalib.cli.output import write_whole


def is_meant_as_folder(path: Path) -> bool:
    """Return whether an output is a folder: it is one, or there is nothing yet and its name does not end in .zip."""
    return path.is_dir() or (not path.exists() and path.suffix.lower() != ".zip")


def write_unpacked(folder: Path, archive: bytes) -> tuple[str, ...]:
    """Write the files of an archive into a folder, which is made if there is none; return their paths in it.

    Raises:
        InputError: a file of that name and other content is there, or the folder cannot be written.
    """
    members = unpack(archive, source=str(folder))
    try:
        for name, data in members.items():
            there = folder / name
            if there.exists() and not (there.is_file() and there.read_bytes() == data):
                raise InputError(
                    f"{folder}: already contains another {name}; name a new folder, or remove the old files"
                )
        for parent in sorted({(folder / name).parent for name in members}):
            parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written: {error.strerror or error}") from error
    for name, data in members.items():
        write_whole(folder / name, data)
    return tuple(members)
