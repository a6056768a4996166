"""The command `cocalib`."""

import os
import signal
import sys
from types import FrameType

# Our matrices are small: threads within one product only slow down the server. Must be set before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from app.cli import run
from app.memory import keep_freed_memory

__all__ = ["main"]


def main() -> None:
    """Run the command given on the command line and exit with its code."""
    keep_freed_memory()
    signal.signal(signal.SIGTERM, _interrupt)
    sys.exit(run(sys.argv[1:]))


def _interrupt(number: int, _: FrameType | None) -> None:
    """Treat SIGTERM like Ctrl+C: a server that a script starts in the background ignores SIGINT, but must close its session."""
    raise KeyboardInterrupt(number)


if __name__ == "__main__":
    main()
