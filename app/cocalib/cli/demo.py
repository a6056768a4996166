"""`cocalib demo`: the sample recording in the browser.

The link is printed and the browser started before the readers, the solver and the server are imported.
"""

import hashlib
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from cocalib.cli.flags import Folder, Switch
from cocalib.cli.serving_flags import ServingFlags
from cocalib.platform.resources import sample_folder, user_session_folder


@dataclass(frozen=True, slots=True)
class Demo:
    """Open the sample recording in the browser."""

    session: Folder = None
    """Session folder; by default, one in your user folder that is kept between runs."""
    fresh: Switch = False
    """Start without the previous clicks (a backup is kept)."""
    serving: Annotated[ServingFlags, tyro.conf.arg(name="")] = field(default_factory=ServingFlags)

    def run(self) -> int:
        """Serve until Ctrl+C, SIGTERM or SIGHUP; return the exit code."""
        sample = sample_folder() / "rooftop"
        bags = (sample / "radar.bag", sample / "camera.bag")
        session = self.session or user_session_folder(f"demo-{_digest(bags)}")
        with closing(self.serving.link(str(session.absolute()))) as link:
            if link.is_bound:
                link.announce()
            from cocalib.opening import Choice, Serving, serve

            choice = Choice(bags, "the sample recording", session=session, fresh=self.fresh, is_sample=True)
            return serve(choice, Serving(link, asks=self.serving.asks))


def _digest(files: Sequence[Path]) -> str:
    """Return a short hash that identifies the version of the sample: a session belongs to one recording."""
    content = hashlib.sha256()
    for file in files:
        content.update(file.read_bytes())
    return content.hexdigest()[:8]
