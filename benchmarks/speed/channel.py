"""One more click among many: what is sent to each page, and the time to make it. Alone: `python -m benchmarks.speed.channel`."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np

from benchmarks.simulated_pairs import FIELD, SimulatedPairs, simulate_pairs
from benchmarks.speed.rows import Row, Table, section
from calib_core.calibration import calibrate_pairs, preview_pairs
from calib_core.measurements import ReflectorClick, TimeNs
from cocalib.session.applying import History
from cocalib.session.state import RecordingFacts, Session
from cocalib.view.build import view
from cocalib.view.model import View
from cocalib.web.channel.outbox import ViewFeed
from cocalib.web.messages.outgoing import encode

__all__ = ["measure_channel"]

Made = TypeVar("Made")
_CLICKS = (100, 1000, 3000, 10_000)
_FRAMES = 20_000
_FRAME_NS = 100_000_000
_START_NS = 1_760_000_000_000_000_000
_CLICK_BYTES = 1000


@dataclass(frozen=True, slots=True)
class _Sent:
    """What one change of the session costs.

    Attributes:
        size_bytes: of the message.
        view_ms: processor time of `view`.
        message_ms: processor time to compare and encode.
        whole_bytes: size of the whole View.
    """

    size_bytes: int
    view_ms: float
    message_ms: float
    whole_bytes: int


def measure_channel(counts: Sequence[int] = _CLICKS) -> Table:
    """Add a click to sessions of different sizes, and let its preview and its checked answer follow."""
    rows: list[Row] = []
    for count in counts:
        click, *answers = _sent(count)
        whole = 3 * click.whole_bytes
        total = click.size_bytes + sum(answer.size_bytes for answer in answers)
        rows += [
            Row(
                f"{count} clicks: one more, its mark",
                f"{_kilobytes(click.size_bytes)}, view {click.view_ms:.1f} ms, message {click.message_ms:.1f} ms",
                f"1/{click.whole_bytes / click.size_bytes:.0f} of a whole View",
                f"under {_kilobytes(_CLICK_BYTES)}",
                click.size_bytes < _CLICK_BYTES,
            ),
            *(
                Row(
                    f"{count} clicks: one more, {name}",
                    f"{_kilobytes(answer.size_bytes)}, view {answer.view_ms:.1f} ms, message {answer.message_ms:.1f} ms",
                    f"1/{answer.whole_bytes / answer.size_bytes:.1f} of a whole View",
                )
                for name, answer in zip(("preview", "checked answer"), answers, strict=True)
            ),
            Row(
                f"{count} clicks: one more, all together",
                _kilobytes(total),
                f"1/{whole / total:.0f} of three whole Views",
            ),
        ]
    return Table(
        "One more click on the channel",
        f"Simulated pairs, 10 % of them wrong, in a recording of {_FRAMES} frames: bytes sent to each page for a click and "
        "then for its preview and its checked answer, and the processor time on the server to build the View and to write the "
        "message. A whole View is what a new page gets, and what every page got for each of the three before changes were "
        "sent. Alone: `python -m benchmarks.speed.channel`.",
        tuple(rows),
    )


def _sent(count: int) -> list[_Sent]:
    """Return the cost of a click, of its preview and of its checked answer, in a session that has been solved before."""
    simulated = _simulated(count + 1)
    frames = np.sort(np.random.default_rng(0).choice(_FRAMES, count + 1, replace=False))
    facts = RecordingFacts("r", _START_NS + np.arange(_FRAMES, dtype=np.int64) * _FRAME_NS, 1280, 720)
    pairs = [dataclasses.replace(pair, id=f"c{number + 1}") for number, pair in enumerate(simulated.pairs)]
    clicks = tuple(
        ReflectorClick(TimeNs(int(facts.image_times[frame])), pair.id, *map(float, pair.pixel_px))
        for frame, pair in zip(frames, pairs, strict=True)
    )
    previous = calibrate_pairs(pairs[:-1], simulated.camera).unwrap()
    preview = preview_pairs(pairs, simulated.camera, previous=previous)
    solved = Session(clicks=clicks[:-1], revision=count, outcome=previous, outcome_revision=count)
    clicked = dataclasses.replace(solved, clicks=clicks, revision=count + 1)
    previewed = dataclasses.replace(clicked, outcome=preview, outcome_revision=count + 1)
    answered = dataclasses.replace(previewed, outcome=calibrate_pairs(pairs, simulated.camera))
    feed = ViewFeed(view(History(solved), facts))
    _, shown = feed.message(None)
    costs = []
    for session in (clicked, previewed, answered):
        newest, view_ms = _timed(partial(view, History(session), facts))
        feed.take(newest)
        (text, shown), message_ms = _timed(partial(feed.message, shown))
        costs.append(_Sent(len(text.encode()), view_ms, message_ms, _whole_bytes(newest)))
    return costs


def _simulated(count: int) -> SimulatedPairs:
    layout = dataclasses.replace(FIELD, separation_m=0.0 if count > 1000 else FIELD.separation_m)
    return simulate_pairs(count, rng=np.random.default_rng(3), outlier_share=0.1, layout=layout)


def _whole_bytes(newest: View) -> int:
    return len(encode(newest).encode())


def _timed(work: Callable[[], Made]) -> tuple[Made, float]:
    start = time.process_time()
    made = work()
    return made, 1000 * (time.process_time() - start)


def _kilobytes(size_bytes: float) -> str:
    return f"{size_bytes / 1000:.1f} kB"


if __name__ == "__main__":
    print("\n".join(section(measure_channel())))
