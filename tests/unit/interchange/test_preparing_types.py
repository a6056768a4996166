"""msgspec learns a type from one thread at a time: two at once crashed the process."""

import threading
from typing import Any, Literal

import msgspec
import pytest

from calib_core.interchange.syntax import strict_json


class Part(msgspec.Struct, frozen=True):
    value: float


class Whole(msgspec.Struct, frozen=True):
    schema: Literal["whole"]
    parts: list[Part]


def test_threads_that_read_the_first_document_of_a_type_prepare_it_once(monkeypatch: pytest.MonkeyPatch) -> None:
    inside, together, learnt = threading.Event(), threading.Event(), []
    decoder = msgspec.json.Decoder

    def slow(document: Any) -> Any:
        if inside.is_set():
            together.set()
        inside.set()
        together.wait(0.2)
        learnt.append(document)
        inside.clear()
        return decoder(document)

    monkeypatch.setattr(strict_json.msgspec.json, "Decoder", slow)
    read: list[Whole] = []
    text = '{"schema": "whole", "parts": [{"value": 1.5}]}'
    threads = [
        threading.Thread(target=lambda: read.append(strict_json.parse_document(text, Whole, source="x")))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert read == [Whole("whole", [Part(1.5)])] * 4
    assert learnt == [Whole]
    assert not together.is_set()
