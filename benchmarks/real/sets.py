"""The table of public sets, sets.toml: a further one is a row, and a converter where our readers cannot know its files."""

import hashlib
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.real import converters
from benchmarks.real.converters import Contents
from calib_core.errors import InputError
from calib_core.options import NoiseOptions


@dataclass(frozen=True, slots=True)
class RealSet:
    """One row of the benchmark.

    Attributes:
        name: for --only.
        what: was measured.
        repository: owner/name on GitHub; its checkout is the folder `name`.
        commit: that the checksum is of.
        license: as the repository states it.
        files: that are read, or patterns of them, in the checkout.
        sha256: over their names and contents.
        read: makes the contents from the checkout, an empty folder for what it writes, and the files.
        bias: what is wrong with the reference, or missing in the set.
        noise: given to the solver.
    """

    name: str
    what: str
    repository: str
    commit: str
    license: str
    files: tuple[str, ...]
    sha256: str
    read: Callable[..., Contents]
    bias: str
    noise: NoiseOptions = field(default_factory=NoiseOptions)

    @property
    def clone(self) -> str:
        """The command that brings the checkout."""
        folder = self.repository.partition("/")[2]
        return f"git clone https://github.com/{self.repository} && git -C {folder} checkout {self.commit}"

    def contents(self, data: Path, scratch: Path) -> Contents:
        """Read the checkout in a folder, its files compared with the checksum.

        Raises:
            InputError: it is not there, or its files are others.
        """
        folder = data / self.repository.partition("/")[2]
        if not folder.is_dir():
            raise InputError(f"not there: {self.clone}")
        if (digest := self.digest(folder)) != self.sha256:
            raise InputError(f"other files, of sha256 {digest}: {self.clone}")
        return self.read(folder, scratch, *self.files)

    def digest(self, folder: Path) -> str:
        """Return the sha256 over the names and contents of the files that are read."""
        whole = hashlib.sha256()
        for path in sorted({path for pattern in self.files for path in folder.glob(pattern) if path.is_file()}):
            content = hashlib.sha256(path.read_bytes()).hexdigest()
            whole.update(f"{content}  {path.relative_to(folder).as_posix()}\n".encode())
        return whole.hexdigest()


def _table() -> dict[str, RealSet]:
    text = Path(__file__).with_name("sets.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    for row in table["sets"]:
        row["files"], row["read"] = tuple(row["files"]), getattr(converters, row["read"])
        row["noise"] = NoiseOptions(**row.get("noise", {}))
    return {row["name"]: RealSet(**row, **table["repositories"][row["repository"]]) for row in table["sets"]}


SETS = _table()
"""By name, in the order of the page."""
