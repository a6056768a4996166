"""Keep index and summary page while a batch is driven."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from cocalib.batch.driving import BatchProgress
from cocalib.fleet.index import FleetIndex, finished_results, read_fleet
from cocalib.fleet.summary_page import write_summary


@contextmanager
def indexed_batch(folder: Path) -> Iterator[Callable[[BatchProgress], None]]:
    """Open the index; yield what to call after each job, and write the summary page at the end.

    For the one process that drives a whole batch; parts of a batch leave the index to `cocalib fleet rebuild`.

    Args:
        folder: holds the results, and what the manifests want.

    Raises:
        InputError: the index is of another version, damaged, or cannot be written.
        OSError: the page cannot be written.
    """
    with FleetIndex(folder) as index:

        def add(now: BatchProgress) -> None:
            if now.latest is not None:
                index.add(now.latest)

        yield add
    if finished_results(folder):
        write_summary(folder, read_fleet(folder))
