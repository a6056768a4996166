"""Where the messages about the choice of a recording are answered, whether one is open or not."""

import asyncio
from typing import Protocol

from calib_core.errors import InputError
from cocalib.web.messages.incoming import Incoming
from cocalib.web.messages.opening_messages import OpeningCommand
from cocalib.web.messages.outgoing import Done, Outgoing, encode


class OpeningService(Protocol):
    """Answers what pages ask about the choice of a recording."""

    def answer(self, command: OpeningCommand) -> Outgoing | None:
        """Answer a message; may read files, so it is called outside the event loop.

        Raises:
            CalibrationError: it cannot be done; nothing changed.
        """
        ...


class NoOpening:
    """Answers for a server that was started with one recording and keeps it."""

    def answer(self, command: OpeningCommand) -> Outgoing | None:
        """Refuse."""
        raise InputError("this server keeps its recording; start cocalib open to choose another one")


async def opening_answers(opening_service: OpeningService, incoming: Incoming) -> list[str]:
    """Return the texts that answer a message about the choice of a recording.

    Raises:
        CalibrationError: it cannot be done; nothing changed.
    """
    assert isinstance(incoming.command, OpeningCommand)
    try:
        answer = await asyncio.get_running_loop().run_in_executor(None, opening_service.answer, incoming.command)
    except OSError as error:
        raise InputError(f"{error.filename or 'a file'}: {error.strerror or error}") from error
    texts = [] if answer is None else [encode(answer)]
    return texts if incoming.request is None else [*texts, encode(Done(incoming.request))]
