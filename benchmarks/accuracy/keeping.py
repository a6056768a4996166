"""Keeping the raw figures of trials on disk, so that an interrupted run can resume."""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from benchmarks.accuracy.rows import Figures

_ROOT = Path(__file__).resolve().parents[2]
_WRITING_ONLY = {"__main__.py", "figures.py", "fresh_seeds.py", "keeping.py", "page.py", "running.py"}


def digest_of_sources() -> str:
    """Return a short digest of all code that the figures depend on, so that figures of different versions are not mixed."""
    content = hashlib.sha256()
    for path in sorted(sources()):
        content.update(str(path.relative_to(_ROOT)).encode() + b"\0" + path.read_bytes() + b"\0")
    return content.hexdigest()[:12]


def sources() -> list[Path]:
    """Return the files of code that the figures depend on."""
    files = [path for path in (_ROOT / "calib_core").rglob("*.py") if not _without_figures(path)]
    return files + [path for path in Path(__file__).parent.rglob("*.py") if path.name not in _WRITING_ONLY]


def _without_figures(path: Path) -> bool:
    return bool({"interchange", "recordings", "rendering"} & set(path.relative_to(_ROOT).parts))


@dataclass(frozen=True, slots=True)
class Keeper:
    """A folder with one file of JSON lines per row."""

    folder: Path

    def read(self, key: str) -> dict[int, Figures]:
        """Return the kept figures by trial number; an incomplete last line is ignored."""
        path = self._path(key)
        kept: dict[int, Figures] = {}
        for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else ():
            try:
                trial = json.loads(line)
            except json.JSONDecodeError:
                continue
            kept[trial["trial"]] = trial["figures"]
        return kept

    def add(self, key: str, trials: Iterable[tuple[int, Figures]]) -> None:
        """Append the figures of some trials."""
        path = self._path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        lines = [json.dumps({"trial": trial, "figures": figures}) + "\n" for trial, figures in trials]
        with path.open("a", encoding="utf-8") as stream:
            if stream.tell() and not path.read_bytes().endswith(b"\n"):
                stream.write("\n")
            stream.write("".join(lines))

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}.jsonl"
