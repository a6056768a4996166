"""The command `cocalib`."""

import os
import signal
import sys
from types import FrameType

# Our matrices are small: threads inside one product only take time from the server. Set before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from app.cli import run
from app.memory import keep_freed_memory

__all__ = ["main"]


def main() -> None:
    """Run the command that was typed and leave with its exit code."""
    keep_freed_memory()
    signal.signal(signal.SIGTERM, _interrupt)
    sys.exit(run(sys.argv[1:]))


def _interrupt(number: int, _: FrameType | None) -> None:
    """Take SIGTERM as Ctrl+C: a server started in the background of a script ignores SIGINT, and must close its session too."""
    raise KeyboardInterrupt(number)


if __name__ == "__main__":
    main()
