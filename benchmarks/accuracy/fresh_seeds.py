"""Seeds that nobody chose: the number of the first trial, from the hash of the present commit."""

import json
import subprocess
from dataclasses import dataclass
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]
_APART = 1_000_000  # more than any row has trials
_FILE = "fresh.json"


@dataclass(frozen=True, slots=True)
class FreshSeeds:
    """The commit whose hash gives the seeds."""

    commit: str

    @property
    def first_trial(self) -> int:
        """The number of the first trial. The fixed seeds start at 0; the ranges do not overlap."""
        return _APART * (1 + int(self.commit[:8], 16))


def fresh_seeds(folder: Path) -> FreshSeeds:
    """Return the seeds of the present commit, and note them in the folder of raw figures.

    Raises:
        OSError: git is not installed.
        subprocess.CalledProcessError: this is not a git checkout.
    """
    answer = subprocess.run(["git", "rev-parse", "HEAD"], cwd=_ROOT, check=True, capture_output=True, text=True)
    seeds = FreshSeeds(answer.stdout.strip())
    folder.mkdir(parents=True, exist_ok=True)
    (folder / _FILE).write_text(json.dumps({"commit": seeds.commit}), encoding="utf-8")
    return seeds


def last_fresh_seeds(folder: Path) -> FreshSeeds | None:
    """Return the seeds of the last fresh run whose figures are in the folder; None if there was none."""
    path = folder / _FILE
    return FreshSeeds(json.loads(path.read_text(encoding="utf-8"))["commit"]) if path.is_file() else None
