"""The command `cocalib`."""

import os
import sys

# Our matrices are small: threads inside one product only take the time of the server beside it. Set before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from app.cli import run
from app.memory import keep_freed_memory

__all__ = ["main"]


def main() -> None:
    """Run the command that was typed and leave with its exit code."""
    keep_freed_memory()
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
