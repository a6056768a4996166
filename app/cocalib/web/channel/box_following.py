"""Following boxes in the background: a few pictures at a time, so that a newer box comes first and all of it can be stopped."""

import asyncio
import logging
import time
from collections.abc import Callable
from concurrent.futures import Executor

from calib_core.recordings import Recording
from cocalib.box_tracks.following import BoxFollower, GreyPictures
from cocalib.box_tracks.stretches import Stretch, stretches_of
from cocalib.platform.error_boundary import error_boundary
from cocalib.web.messages import Progress
from cocalib.workspace import Workspace

_AT_ONCE_S = 0.15
"""Work is handed out in pieces of this length: a newer box waits no longer [s]."""
_TELL_EVERY_S = 0.6
"""Pages are told no more often [s]."""
_FOLLOWING = "Following boxes"
_log = logging.getLogger(__name__)


class BoxFollowing:
    """Follows the boxes of a session. Runs on the event loop; the pictures are searched in a thread."""

    def __init__(
        self, workspace: Workspace, recording: Recording, executor: Executor, tell: Callable[[Progress], None]
    ) -> None:
        """Set up the work.

        Args:
            workspace: has the boxes, and takes in what was followed.
            recording: has the pictures.
            executor: where they are searched.
            tell: takes the progress.
        """
        self._workspace = workspace
        self._executor = executor
        self._tell = tell
        self._follower = BoxFollower(GreyPictures(recording), lambda: len(workspace.facts.image_times))
        self._wanted: tuple[Stretch, ...] = ()
        self._taken: tuple[Stretch, ...] = ()
        self._stopping = False
        self._is_last = False
        self._task: asyncio.Task[None] | None = None

    def follow(self) -> None:
        """Follow the boxes as they are now."""
        facts, tracks = self._workspace.facts, self._workspace.session.boxes
        self._wanted = tuple(stretch for track in tracks if track.is_carried for stretch in stretches_of(track, facts))
        if self._wanted != self._taken and (self._task is None or self._task.done()):
            self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def is_busy(self) -> bool:
        """Whether there is something left to follow."""
        return self._task is not None and not self._task.done() and not self._is_last

    def stop(self) -> None:
        """End what is still being followed where it is now."""
        self._stopping = self._task is not None and not self._task.done()

    async def close(self) -> None:
        """Follow no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def _run(self) -> None:
        with error_boundary("following boxes", _log.error):
            told, self._is_last = time.monotonic(), False
            while self._wanted != self._taken or not self._follower.is_done:
                if self._wanted != self._taken:
                    self._taken = self._wanted
                    self._follower.want(self._order(self._taken))
                if self._stopping:
                    self._follower.stop()
                await asyncio.get_running_loop().run_in_executor(self._executor, self._follower.go_on, _AT_ONCE_S)
                if time.monotonic() - told > _TELL_EVERY_S:
                    told = time.monotonic()
                    self._show()
            self._stopping, self._is_last = False, True
            self._show()

    def _order(self, stretches: tuple[Stretch, ...]) -> list[Stretch]:
        """Return the stretches so that those not begun so far come last: they are followed first."""
        begun = self._follower.followed
        return sorted(stretches, key=lambda stretch: stretch.start not in begun)

    def _show(self) -> None:
        self._tell(Progress(_FOLLOWING, *self._follower.progress))
        self._workspace.show_followed(self._follower.followed)
