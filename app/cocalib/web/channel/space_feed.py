"""The 3D view of one page: collects what it shows at one moment, and draws it unless the page is playing or has hidden it."""

import asyncio
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeVar

import numpy as np

from calib_core.arrays import Points3
from calib_core.errors import CalibrationError
from calib_core.measurements import RadarScans, TimeNs
from calib_core.radar import RadarErrors
from cocalib.view.reference import shown_calibration
from cocalib.web.channel.hub import Hub
from cocalib.web.channel.radar_survey import Survey
from cocalib.web.frames import Frame
from cocalib.web.messages.incoming import CursorMoved
from cocalib.web.messages.space_messages import SpaceFrame
from cocalib.web.radar_sight import Returns
from cocalib.web.view3d.extent import UNKNOWN, Extent, extent_of
from cocalib.web.view3d.returns import Colouring
from cocalib.web.view3d.scene import TabScene
from cocalib.web.view3d.sight import Sight, space_frame

_PLAYING_EVERY_S, _LOOKING_EVERY_S = 1.0, 0.34
"""Minimum time between two drawings while playing, with and without images: the 3D view shares the page's main thread, and the
image comes first [s]."""

_MOST_RETURNS = 20_000
_SLOWEST_MPS = 1.0

Read = TypeVar("Read")


class SpaceFeed:
    """Draws the 3D view of one page. Runs on the event loop; one drawing at a time."""

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._number = 0
        self._drawn_at_s = 0.0
        self._fastest_mps = _SLOWEST_MPS
        self._surveyed: Survey | None = None
        self._extent = UNKNOWN

    async def draw(self, cursor: CursorMoved, scene: TabScene) -> SpaceFrame | None:
        """Draw a frame; return what the page draws over it, None if nothing was drawn.

        While playing, it is drawn once a second, or thrice without images; the frame at which the page stops is always drawn.
        """
        every_s = _PLAYING_EVERY_S if self._hub.workspace.facts.has_images else _LOOKING_EVERY_S
        if cursor.hidden or (cursor.playing and time.monotonic() < self._drawn_at_s + every_s):
            return None
        self._number += 1
        sight = await self._sight(cursor)
        look = await asyncio.get_running_loop().run_in_executor(self._hub.executor, _draw_frame, scene, sight)
        self._drawn_at_s = time.monotonic()
        return look

    async def _sight(self, cursor: CursorMoved) -> Sight:
        hub, stamp = self._hub, TimeNs(int(self._hub.moments[cursor.index]))
        has_images = hub.workspace.facts.has_images
        session = hub.workspace.session
        calibration = shown_calibration(session, hub.workspace.reference)
        corrected = (calibration.radar_errors if calibration else RadarErrors()).corrected
        returns = await self._returns(cursor, stamp, corrected)
        survey = hub.survey
        return Sight(
            number=self._number,
            index=cursor.index,
            session=session,
            view=hub.view,
            selected=cursor.selected,
            returns=returns,
            trail_s=cursor.trail_s,
            window=await self._window(cursor, corrected),
            image=await self._thumbnail(cursor) if has_images else None,
            camera=hub.camera,
            has_images=has_images,
            colouring=self._colouring(cursor, survey, returns),
            placements=survey.placements if survey else (),
            map=survey.map if survey and cursor.whole else None,
            reference=hub.workspace.reference,
        )

    async def _returns(self, cursor: CursorMoved, stamp: TimeNs, corrected: Callable[[Points3], Points3]) -> Returns:
        radar, gating = self._hub.radar, self._hub.workspace.session.options.gating
        if cursor.trail_s > 0:
            scans = await self._read(partial(radar.trail, stamp, cursor.trail_s), RadarScans())
            returns = Returns.of(scans, stamp, gating, corrected)
        else:
            returns = Returns.of_scan(await self._read(partial(radar.scan_at, stamp), None), gating, corrected)
        return returns.thinned(_MOST_RETURNS)

    async def _window(self, cursor: CursorMoved, corrected: Callable[[Points3], Points3]) -> Returns:
        session = self._hub.workspace.session
        click = next((click for click in session.clicks if click.id == cursor.selected), None)
        scans = RadarScans()
        if click is not None and not cursor.playing:
            scans = await self._read(partial(self._hub.radar.window, click.image_time, session.options), scans)
        returns = Returns.of(scans, TimeNs(0), session.options.gating, corrected)
        return replace(returns, age_s=np.zeros(len(returns)))

    async def _read(self, read: Callable[[], Read], otherwise: Read) -> Read:
        """Read the radar off the event loop; what cannot be read is not shown."""
        try:
            return await asyncio.get_running_loop().run_in_executor(self._hub.executor, read)
        except CalibrationError:
            return otherwise

    async def _thumbnail(self, cursor: CursorMoved) -> Frame | None:
        try:
            return await self._hub.frames.get(cursor.index, "thumbnail")
        except (CalibrationError, ValueError):
            return None

    def _colouring(self, cursor: CursorMoved, survey: Survey | None, returns: Returns) -> Colouring:
        extent, fastest_mps = self._extent_now(survey, returns), self._fastest_now(returns)
        return Colouring(cursor.colour, extent, _ends_db(survey, returns), fastest_mps, cursor.light)

    def _extent_now(self, survey: Survey | None, returns: Returns) -> Extent:
        if survey is not self._surveyed and survey is not None:
            self._surveyed = survey
            self._extent = surveyed_extent(survey, returns)
        return self._extent

    def _fastest_now(self, returns: Returns) -> float:
        """Return the end of the colours of Doppler: it only rises, so that colours keep their meaning."""
        speeds = np.abs(returns.doppler_mps[np.isfinite(returns.doppler_mps)])
        if len(speeds):
            self._fastest_mps = max(self._fastest_mps, float(np.ceil(np.quantile(speeds, 0.98))))
        return self._fastest_mps


def surveyed_extent(survey: Survey, returns: Returns) -> Extent:
    """Return the extent of a recording: of its placements and of the static returns in the range of the gate.

    Without a placement nothing says that the reflector is near, and all that the radar sees now counts, also beyond the gate.

    Args:
        survey: of the recording.
        returns: that are shown when the survey is known.
    """
    points = np.stack([survey.map.x_m, survey.map.y_m, survey.map.z_m], axis=1)
    weights = np.array(survey.map.share)
    reflectors = np.array([placement.position_radar_m for placement in survey.placements]).reshape(-1, 3)
    if not survey.placements:
        points, weights = np.concatenate([points, returns.points_m]), np.append(weights, np.ones(len(returns)))
    return extent_of(points, weights, reflectors)


def _draw_frame(scene: TabScene, sight: Sight) -> SpaceFrame:
    scene.show(sight)
    return space_frame(sight)


def _ends_db(survey: Survey | None, returns: Returns) -> tuple[float, float] | None:
    """Return the amplitudes of weak and strong returns: of the whole recording, or of these until that is known."""
    if survey is not None and survey.map.low_db is not None and survey.map.high_db is not None:
        return survey.map.low_db, survey.map.high_db
    known = returns.snr_db[np.isfinite(returns.snr_db)]
    if survey is not None or len(known) < 2 or known.min() == known.max():
        return None
    return float(known.min()), float(known.max())
