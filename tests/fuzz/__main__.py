"""Fuzz until the time is over: `python -m tests.fuzz --seconds 600`; the corpus grows in .fuzz/ from run to run."""

import argparse
import hashlib
import os
import random
import sys
import tempfile
import time
from pathlib import Path

os.environ["COCALIB_CACHE"] = "off"
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

MOST_MEMORY_BYTES = 4 << 30
GROWN = Path(".fuzz")


def main() -> int:
    """Fuzz the chosen targets in turn; return 1 if there are findings."""
    from tests.fuzz.corpus import corpus_of
    from tests.fuzz.fuzzing import fuzz
    from tests.fuzz.targets import TARGETS

    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="for all targets together")
    parser.add_argument("--seed", type=int, help="of the mutations; by default another one each time")
    parser.add_argument("--target", action="append", choices=[target.name for target in TARGETS], help="only this one")
    asked = parser.parse_args()
    _bound_memory()
    chosen = [target for target in TARGETS if asked.target is None or target.name in asked.target]
    seed = random.SystemRandom().randrange(1 << 32) if asked.seed is None else asked.seed
    print(f"seed {seed}, {asked.seconds / len(chosen):.0f} s for each of {len(chosen)} targets")
    found = 0
    for target in chosen:
        until = time.monotonic() + asked.seconds / len(chosen)
        grown = GROWN / target.name
        corpus = [*corpus_of(target.name), *(path.read_bytes() for path in sorted(grown.glob("*.bin")))]
        with tempfile.TemporaryDirectory() as folder:
            report = fuzz(
                target,
                corpus,
                Path(folder),
                rng=random.Random(seed),
                go_on=lambda _, until=until: time.monotonic() < until,
            )
        grown.mkdir(parents=True, exist_ok=True)
        for data in report.added:
            (grown / f"{hashlib.sha256(data).hexdigest()[:12]}.bin").write_bytes(data)
        for finding in report.findings:
            path = grown / f"finding-{finding.name}.bin"
            path.write_bytes(finding.data)
            print(f"\n{target.name}: {path}\n{finding.what}")
        found += len(report.findings)
        print(
            f"{target.name}: {report.tried} inputs, {report.lines} lines reached, {len(report.added)} inputs new in the corpus, "
            f"{len(report.findings)} findings",
            flush=True,
        )
    return 1 if found else 0


def _bound_memory() -> None:
    """Make an input that eats memory a finding, where the system can."""
    if sys.platform == "linux":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY_BYTES, MOST_MEMORY_BYTES))


if __name__ == "__main__":
    sys.exit(main())
