"""What an engine is: it calls a function many times somewhere, and returns what comes of each call as it comes."""

import shutil
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

from calib_core.errors import InputError
from cocalib.batch.results_folder import Writer, is_abandoned

_Found = TypeVar("_Found")
_OWN_FOLDER = "cocalib-batch"


def workers_died(number: int) -> Any:
    """Refuse to go on without the result of a call.

    Raises:
        InputError: always.
    """
    raise InputError(f"call {number}: every worker that ran it died or was killed; use fewer workers")


@dataclass(frozen=True, slots=True)
class Call:
    """The arguments of one call of a function that every worker can import.

    Attributes:
        number: of the call.
        arguments: that can be pickled.
    """

    number: int
    arguments: tuple[Any, ...]


class Engine(Protocol):
    """Runs calls. What comes of them comes in any order."""

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        """Call a function with each of the arguments; yield the number of the arguments and what it returned.

        Args:
            function: of a module, so that every worker can import it. What it raises is raised here.
            arguments: of each call.
            if_died: gives the result of a call, by its number, of which every worker died.

        Raises:
            InputError: the engine cannot be used.
        """
        ...


class InProcess:
    """Runs calls in this process, in order."""

    def run_all(
        self,
        function: Callable[..., _Found],
        arguments: Sequence[tuple[Any, ...]],
        if_died: Callable[[int], _Found] = workers_died,
    ) -> Generator[tuple[int, _Found], None, None]:
        """Call a function with each of the arguments, in order."""
        with own_temporary_folder():
            for number, given in enumerate(arguments):
                yield number, function(*given)


@contextmanager
def own_temporary_folder() -> Iterator[Path]:
    """Keep the temporary files of this process in a folder of its own, which is gone afterwards.

    If this process is killed, the next one that comes here removes the folder.
    """
    usual = Path(tempfile.gettempdir())
    for left in usual.glob(f".{_OWN_FOLDER}.*"):
        if is_abandoned(left):
            shutil.rmtree(left, ignore_errors=True)
    own = usual / Writer.this().folder_name(_OWN_FOLDER)
    own.mkdir(mode=0o700)
    tempfile.tempdir = str(own)
    try:
        yield own
    finally:
        tempfile.tempdir = str(usual)
        shutil.rmtree(own, ignore_errors=True)
