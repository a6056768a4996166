"""Drive the page: wait for a condition, click an image point, read the state."""

import json
import math
import re
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from playwright.sync_api import Page

__all__ = ["FLAGS", "PATIENCE_S", "Driver"]

FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-background-timer-throttling",
    "--disable-renderer-backgrounding",
    # Replaces Playwright's own list, which comes first. The last line is ours: with a popup of its own for the address bar, which
    # nobody sees, and a spare process, Chromium spends a second of processor time on every window.
    "--disable-features=AvoidUnnecessaryBeforeUnloadCheckSync,DestroyProfileOnBrowserClose,HttpsUpgrades,"
    "HttpsFirstBalancedModeAutoEnable,LensOverlay,MediaRouter,PaintHolding,ThirdPartyStoragePartitioning,"
    "AvoidCorsURLLoaderRestartOnRedirect,TcpPortRandomizationWin,OptimizationHints,NetworkTimeServiceQuerying,AimEnabled,"
    "PreconnectToSearch,"
    "WebUIOmniboxPopup,WebUIOmniboxAimPopup,WebUIOmniboxFullPopup,SpareRendererForSitePerProcess",
]

PATIENCE_S = 40
"""How long is waited for anything: the machine may be busy with something else."""


class Driver:
    """One open page and what a user does with it."""

    def __init__(self, page: Page, url: str, ready: str = "__cocalib.state.shown") -> None:
        self.page = page
        self.complaints: list[str] = []
        self.addresses: set[str] = set()
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.complaints.append(f"error: {error}"))
        page.on("request", lambda request: self.addresses.add(request.url))
        page.on("websocket", lambda socket: self.addresses.add(socket.url))
        page.set_default_timeout(PATIENCE_S * 1000)
        page.goto(url, wait_until="commit")
        page.wait_for_url(re.compile(r"^http[^?]*$"), wait_until="commit")  # the link leads on to the page
        self.until(ready)

    def _console(self, message: Any) -> None:
        if message.type == "error":
            self.complaints.append(message.text)

    @property
    def strangers(self) -> list[str]:
        """Addresses on other machines that the page asked for."""
        own = ("http://127.0.0.1", "ws://127.0.0.1", "blob:", "data:")
        return [url for url in self.addresses if not url.startswith(own)]

    def forget_lost_connections(self) -> None:
        """Drop the browser's own complaints about a server that was down, still opening, or did not know the page yet."""
        expected = ("WebSocket connection", "ERR_CONNECTION_REFUSED", "status of 401", "status of 503")
        self.complaints[:] = [text for text in self.complaints if not any(words in text for words in expected)]

    def until(self, condition: str, seconds: float = PATIENCE_S) -> None:
        """Wait until a JavaScript condition holds and what the page draws because of it is drawn.

        The page's policy forbids eval, so the condition goes in as a function.
        """
        self.page.evaluate(
            f"""() => new Promise((resolve, reject) => {{
                const end = performance.now() + {seconds * 1000};
                const look = () => {{
                    let holds = false;
                    try {{ holds = Boolean({condition}); }} catch {{ holds = false; }}
                    if (holds) requestAnimationFrame(() => setTimeout(() => resolve(true)));
                    else if (performance.now() > end) reject(new Error({condition!r} + " never came"));
                    else setTimeout(look, 15);
                }};
                look();
            }})"""
        )

    def value(self, expression: str) -> Any:
        """Evaluate in the page."""
        return self.page.evaluate(f"() => ({expression})")

    def drawn(self) -> None:
        """Wait until the browser has laid out and drawn twice, so that earlier changes are on the screen."""
        self.page.evaluate(
            "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
        )

    @property
    def view(self) -> Any:
        """The last view sent by the server."""
        return self.value("__cocalib.state.view")

    def frame_at(self, stamp: dict[str, int]) -> int:
        """Return the index of the frame with this stamp."""
        return int(
            self.value(
                "__cocalib.state.recording.frame_times.sec.findIndex((sec, index) => "
                f"sec === {stamp['sec']} && __cocalib.state.recording.frame_times.nanosec[index] === {stamp['nanosec']})"
            )
        )

    def go_to(self, index: int) -> None:
        """Step to a frame and wait until it is on the screen."""
        self.value(f"__cocalib.goTo({index})")
        self.until(f"__cocalib.state.shown.index === {index} && __cocalib.state.shown.scale === 1")

    def place_of(self, u: float, v: float) -> tuple[float, float]:
        """Return the position of an image point on the page [CSS px]."""
        x, y = self.value(
            "(() => { const box = document.getElementById('marks').getBoundingClientRect();"
            f"const [x, y] = __cocalib.toCss({u}, {v}); return [box.left + x, box.top + y]; }})()"
        )
        return float(x), float(y)

    def click(self, u: float, v: float) -> None:
        """Click an image point and wait until the server has confirmed it."""
        self.page.mouse.click(*self.place_of(u, v))
        self.settle()

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag from one image point to another."""
        (x, y), (to_x, to_y) = self.place_of(*start), self.place_of(*end)
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move((x + to_x) / 2, (y + to_y) / 2)
        self.page.mouse.move(to_x, to_y)
        self.page.mouse.up()
        self.settle()

    def press(self, *keys: str) -> None:
        """Press keys one after the other and wait for what they do."""
        for key in keys:
            self.page.keyboard.press(key)
        self.settle()

    def settle(self) -> None:
        """Wait until nothing is pending: no unconfirmed event, no local mark, no solve."""
        self.until("__cocalib.unconfirmed() === 0 && __cocalib.state.local.size === 0")
        self.until("!__cocalib.state.view.solving")

    def click_sample(self, truth: dict[str, Any], count: int | None = None) -> None:
        """Click the reflector in every placement of the sample, where it was rendered."""
        for placement in truth["placements"][:count]:
            self.go_to(self.frame_at(placement["best_image_time"]))
            self.page.mouse.click(*self.place_of(*placement["pixel_px"]))
            self.until("__cocalib.unconfirmed() === 0")
        self.settle()

    def load_sample(
        self, truth: dict[str, Any], count: int | None = None, *, name: Callable[[int], str] = "c{}".format
    ) -> None:
        """Load the same clicks as from a file: one step and one solve, where it does not matter how they came.

        Args:
            truth: of the sample.
            count: of the placements that are clicked.
            name: the id of the click at a placement, by its number from 1.
        """
        placements = truth["placements"][:count]
        clicks = [
            {"id": name(number), "image_time": placement["best_image_time"], "pixel_px": placement["pixel_px"]}
            for number, placement in enumerate(placements, 1)
        ]
        self.page.evaluate(
            "text => import('./base/socket.js').then(({ send }) => send({ type: 'import_clicks', text, name: 'clicks.json' }))",
            json.dumps({"schema": "cocalib/clicks-1", "clicks": clicks}),
        )
        self.go_to(self.frame_at(placements[-1]["best_image_time"]))
        self.settle()

    def text(self, selector: str) -> str:
        """Return the text of an element, with a plain space between a number and its unit."""
        return self.page.inner_text(selector).replace("\u00a0", " ")

    def said(self, words: dict[str, Any]) -> str:
        """Return words of the server as the page says them."""
        return str(self.page.evaluate("words => import('/base/state.js').then(({ said }) => said(words))", words))

    def pixels(self, selector: str) -> np.ndarray:
        """Return a screenshot of an element: (h, w, 3) BGR."""
        image = cv2.imdecode(np.frombuffer(self.page.locator(selector).screenshot(), np.uint8), cv2.IMREAD_COLOR)
        assert image is not None
        return np.asarray(image)

    def zoom_to(self, u: float, v: float, factor: float) -> None:
        """Turn the wheel over an image point until there are this many screen pixels per image pixel."""
        deadline = time.monotonic() + 20
        self.page.mouse.move(*self.place_of(u, v))
        while abs(self.value("__cocalib.zoom()") / factor - 1) > 0.02:
            assert time.monotonic() < deadline, "the wheel does not zoom"
            ratio = factor / self.value("__cocalib.zoom()")
            step = max(-400.0, min(400.0, -625.0 * math.log(ratio)))
            before = self.value("__cocalib.zoom()")
            self.page.mouse.wheel(0, step)
            self.until(f"__cocalib.zoom() !== {before!r}")
