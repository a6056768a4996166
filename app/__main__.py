"""The command `cocalib`."""

import sys

from app.cli import run

__all__ = ["main"]


def main() -> None:
    """Run the command that was typed and leave with its exit code."""
    sys.exit(run(sys.argv[1:]))


if __name__ == "__main__":
    main()
