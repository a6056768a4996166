"""The command `cocalib`."""

import os
import sys

# Our matrices are small: threads within one product only slow down the server. Must be set before NumPy loads.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from cocalib.cli import run
from cocalib.platform.error_boundary import report_thread_errors
from cocalib.platform.process import keep_freed_memory, stop_on_signals


def main() -> None:
    """Run the command given on the command line and exit with its code."""
    keep_freed_memory()
    stop_on_signals()
    report_thread_errors()
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
