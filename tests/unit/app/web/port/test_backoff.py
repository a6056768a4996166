"""Trying tokens gets slower and slower; an admitted page never waits."""

import asyncio
from collections.abc import Iterator
from pathlib import Path

import pytest

from cocalib.web.port import entrance as module
from cocalib.web.port.entrance import Backoff
from cocalib.web.port.server import RunningServer
from tests.image_recording import ImageRecording, grey_images
from tests.port_client import come_in, get
from tests.serving import serving

TOKEN = "a long enough token"


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_the_delay_grows_to_a_limit_and_is_forgotten():
    clock = Clock()
    tries = Backoff(clock)
    delays = []
    for _ in range(40):
        delays.append(tries.delay_s)
        tries.wrong()
    assert delays[:5] == [0.0] * 5, "a few mistakes cost nothing"
    assert delays[5:11] == [0.25, 0.5, 1.0, 2.0, 4.0, 8.0]
    assert set(delays[11:]) == {8.0}
    clock.now += 301
    assert tries.delay_s == 0
    tries.wrong()
    tries.right()
    assert tries.delay_s == 0


def test_tries_take_turns_and_only_so_many_wait():
    async def run() -> tuple[list[bool], list[bool]]:
        tries = Backoff()
        for _ in range(30):
            tries.wrong()
        waiting = [asyncio.create_task(tries.turn()) for _ in range(20)]
        done, late = await asyncio.wait(waiting, return_when=asyncio.FIRST_COMPLETED)
        for task in late:
            task.cancel()
        outcomes = await asyncio.gather(*late, return_exceptions=True)
        return [task.result() for task in done], [isinstance(one, asyncio.CancelledError) for one in outcomes]

    refused, cancelled = asyncio.run(run())
    assert refused == [False] * 12
    assert cancelled == [True] * 8


@pytest.fixture
def server(tmp_path: Path) -> Iterator[RunningServer]:
    recording = ImageRecording(grey_images(1))
    with serving(recording, tmp_path / "s", name="one grey", token=TOKEN) as (running, _):
        yield running


def test_wrong_tokens_are_slowed_down_and_an_admitted_page_is_not(server, monkeypatch):
    slept: list[float] = []
    sleep = asyncio.sleep

    async def note(delay: float) -> None:
        slept.append(delay)
        await sleep(0)

    cookie = come_in(server)
    monkeypatch.setattr(module.asyncio, "sleep", note)
    for number in range(9):
        assert get(server, f"/?token=wrong{number}").status == 401
    assert [delay for delay in slept if delay] == [0.25, 0.5, 1.0, 2.0]
    slept.clear()
    assert get(server, "/", Cookie=cookie).status == 200
    assert get(server, "/?token=anything", Cookie=cookie).status == 200
    assert slept == [], "an admitted page never waits"
    assert get(server, f"/?token={TOKEN.replace(' ', '%20')}").status == 200
    assert slept == [4.0], "the right one waits for its turn too, or its speed would tell"
