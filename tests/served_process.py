"""Run `cocalib open`, or `cocalib demo`, in its own process, as a user does; its address is used as that of a RunningServer."""

import http.client
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path


@dataclass(slots=True)
class ServedProcess:
    """A running command.

    Attributes:
        process: it.
        url: the link that it printed.
    """

    process: "subprocess.Popen[str]"
    url: str

    @property
    def origin(self) -> str:
        """The address without a token."""
        return self.url.partition("/?")[0]

    @property
    def port(self) -> int:
        """The port that it serves on."""
        return int(self.origin.rpartition(":")[2])

    def stop(self) -> tuple[int, str]:
        """End it as Ctrl+C does; return its exit code and what it printed since the link."""
        self.process.send_signal(signal.SIGINT)
        printed = self.process.communicate(timeout=60)[0]
        return self.process.returncode, printed


@contextmanager
def served_process(*arguments: object, state: Path, command: str = "open", port: int = 0) -> Iterator[ServedProcess]:
    """Start the command without proposals, and wait until it answers; it is ended with the `with` block.

    The link is printed before the server is imported: a page that opens it at once would wait for that, too.

    Args:
        arguments: those after the command.
        state: the folder for its state.
        command: that serves.
        port: to serve on.
    """
    program = "import signal\nsignal.signal(signal.SIGINT, signal.default_int_handler)\nfrom cocalib.__main__ import main\nmain()"
    flags = ("--no-browser", "--no-proposals", "--port", str(port))
    process = subprocess.Popen(
        [sys.executable, "-c", program, command, *map(str, arguments), *flags],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1", "XDG_STATE_HOME": str(state)},
    )
    try:
        assert process.stdout is not None
        printed = []
        for line in process.stdout:
            printed.append(line)
            if found := re.search(r"Open (http\S+)", line):
                served = ServedProcess(process, found[1])
                connection = http.client.HTTPConnection("127.0.0.1", served.port)
                connection.request("GET", "/")
                connection.getresponse().read()
                yield served
                break
        else:
            raise AssertionError(f"no link was printed: {''.join(printed)}")
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate()
