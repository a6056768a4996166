"""The channel's messages: what is understood, what is refused, and what is written."""

import json
import runpy
import struct
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import CalibrationError, InputError, OptionError
from calib_core.measurements import Stamp, TimeNs
from cocalib.session.applying import History, advance
from cocalib.session.events import (
    Cleared,
    ClickExcluded,
    ClickMoved,
    ClickPlaced,
    ClickRemoved,
    OptionsChanged,
    Redo,
    Undo,
)
from cocalib.session.state import RecordingFacts
from cocalib.view.build import view
from cocalib.view.model import View
from cocalib.web.messages.incoming import (
    MAX_TEXT_BYTES,
    CursorMoved,
    FrameWanted,
    Hello,
    ImportWanted,
    Incoming,
    ProposingSwitch,
    ViewpointWanted,
    parse,
    request_of,
)
from cocalib.web.messages.outgoing import (
    Done,
    FrameHeader,
    Overlay,
    OverlayGuess,
    Problem,
    Progress,
    RecordingNote,
    SensorNote,
    SessionNote,
    StampColumns,
    change_between,
    encode,
    encode_frame,
)
from cocalib.web.messages.space_messages import RadarReturn


def stated(sec: str, nanosec: str = "0") -> str:
    return f'{{"type":"click_placed","image_time":{{"sec":{sec},"nanosec":{nanosec}}},"pixel_px":[1,2]}}'


def moved(pixel_px: str) -> str:
    return f'{{"type":"click_moved","id":"c1","pixel_px":{pixel_px}}}'


FACTS = RecordingFacts("drive", 1_700_000_000_123_456_789 + 100_000_000 * np.arange(3), width_px=640, height_px=480)


@pytest.mark.parametrize(
    ("text", "command"),
    [
        ('{"type":"hello"}', Hello()),
        (stated("1700000000", "123456789"), ClickPlaced(TimeNs(1_700_000_000_123_456_789), (1.0, 2.0), "clicked")),
        (moved("[1.5,2.5]"), ClickMoved("c1", (1.5, 2.5))),
        ('{"type":"click_removed","id":"c1"}', ClickRemoved("c1")),
        ('{"type":"click_excluded","id":"c1","excluded":true}', ClickExcluded("c1", True)),
        ('{"type":"options_changed","options":{"method":"paper"}}', OptionsChanged({"method": "paper"})),
        ('{"type":"cleared"}', Cleared()),
        ('{"type":"undo"}', Undo()),
        ('{"type":"redo"}', Redo()),
        ('{"type":"cursor","index":7}', CursorMoved(7)),
        ('{"type":"viewpoint","viewpoint":"above"}', ViewpointWanted("above")),
        ('{"type":"propose","on":false}', ProposingSwitch(on=False)),
        ('{"type":"import_clicks","text":"{}","name":"a.json"}', ImportWanted("{}", "a.json")),
    ],
)
def test_every_message_of_the_page_is_understood_with_and_without_a_request(text, command):
    assert parse(text) == Incoming(command)
    assert parse(text[:-1] + ',"request":12}') == Incoming(command, 12)
    assert parse(text.encode()) == Incoming(command)


def test_a_frame_is_asked_for_with_the_number_its_image_will_carry():
    assert parse('{"type":"frame","index":3,"request":9,"playing":true,"size":"half"}') == Incoming(
        FrameWanted(3, 9, playing=True, size="half")
    )
    assert parse('{"type":"frame","index":3,"request":9}').command == FrameWanted(3, 9, playing=False, size="full")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        *((text, "not JSON") for text in ("", "{", "hello", moved("[NaN,2]"), moved("[1e999,2]"))),
        ("[1]", "object"),
        ("null", "object"),
        ("{}", "unknown message type 'None'; known: click_placed"),
        ('{"type":"click_place"}', "unknown message type 'click_place'; did you mean click_placed?"),
        ('{"type":["undo"]}', "unknown message type"),
        ('{"type":"undo","colour":"red"}', "invalid message 'undo': Object contains unknown field `colour`"),
        ('{"type":"click_removed"}', "missing required field `id`"),
        ('{"type":"click_removed","id":""}', "length >= 1"),
        ('{"type":"click_removed","id":5}', "Expected `str`, got `int` - at `$.id`"),
        (moved("[1]"), "`$.pixel_px`"),
        (moved('["1","2"]'), "`$.pixel_px[0]`"),
        (moved("[null,2]"), "`$.pixel_px[0]`"),
        ('{"type":"click_placed","image_time":1.7e9,"pixel_px":[1,2]}', "`$.image_time`"),
        (stated("1", "1000000000"), "in `nanosec` - at `$.image_time`"),
        (stated("-1"), "in `sec` - at `$.image_time`"),
        (stated("1e30"), "in `sec` - at `$.image_time`"),
        ('{"type":"undo","request":-1}', "invalid message 'undo'"),
        ('{"type":"undo","request":"1"}', "invalid message 'undo'"),
        ('{"type":"frame","index":-1,"request":1}', "`$.index`"),
        ('{"type":"frame","index":1}', "missing required field `request`"),
        ('{"type":"frame","index":1,"request":1,"size":"huge"}', "`$.size`"),
        ('{"type":"options_changed","options":[]}', "`$.options`"),
        ('{"type":"options_changed","options":{"noise":{"sigma":1}}}', "did you mean noise.sigma_px?"),
        ("x" * (MAX_TEXT_BYTES + 1), "longer than 4 MB"),
        ('{"type":"options_changed","options":' + '{"a":' * 100_000 + "1" + "}" * 100_001, "not JSON"),
    ],
    ids=lambda value: value[:60],
)
def test_what_is_not_understood_is_refused_with_a_clear_error(text, words):
    with pytest.raises((InputError, OptionError)) as refused:
        parse(text)
    assert words in str(refused.value)


@given(st.one_of(st.text(max_size=200), st.binary(max_size=200)))
def test_arbitrary_input_is_refused(text):
    with pytest.raises(CalibrationError):
        parse(text)
    assert request_of(text) is None or isinstance(request_of(text), int)


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(max_size=8),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["sec", "noise", "x"]), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(
    st.sampled_from(["click_placed", "click_moved", "clicks_imported", "options_changed", "frame", "cursor", "undo"]),
    st.dictionaries(
        st.sampled_from(["id", "index", "request", "pixel_px", "image_time", "options", "clicks"]), json_values
    ),
)
def test_a_known_type_with_odd_fields_is_understood_or_refused(kind, fields):
    try:
        parsed = parse(json.dumps({"type": kind, **fields}))
    except CalibrationError:
        return
    assert isinstance(parsed, Incoming)


def test_the_number_of_a_refused_message_is_found_where_it_can_be():
    assert request_of('{"type":"clik","request":7}') == 7
    for text in ('{"type":"undo","request":"7"}', '{"type":"undo"}', "{", "[7]", b"\xff\xfe"):
        assert request_of(text) is None


def test_a_view_is_written_as_plain_json_with_its_type():
    history = advance(History(), ClickPlaced(TimeNs(int(FACTS.image_times[1])), (1.5, 2.5), "clicked"), FACTS)
    shown = view(history, FACTS)
    written = json.loads(encode(shown))
    assert written.pop("type") == "view"
    assert set(written) == {field.name for field in fields(View)}
    assert written["clicks"][0]["image_time"] == {"sec": 1700000000, "nanosec": 223456789}
    assert written["options"]["solving"]["camera_position"] is None


@pytest.mark.parametrize(
    ("name", "written"), [("drive\udcff.bag", "drive\\udcff.bag"), ("\ud800", "\\ud800"), ("é ✓", "é ✓")]
)
def test_a_recording_is_sent_with_every_nanosecond_and_a_name_that_is_not_unicode_as_an_escape(name, written):
    stamps, sensors = StampColumns.of(FACTS.image_times), (SensorNote("radar", name, about=(name,)),)
    session = SessionNote(name, 0)
    note = RecordingNote(name, name, "/i", 640, 480, True, stamps, Stamp(1, 2), stamps, (), sensors, session, "0.1")
    sent = json.loads(encode(note).encode("utf-8"))
    assert (sent["name"], sent["sensors"][0]["topic"], sent["session"]["folder"]) == (written,) * 3
    assert sent["frame_times"] == {"sec": [1700000000] * 3, "nanosec": [123456789, 223456789, 323456789]}
    assert [group["name"] for group in sent["option_groups"]][:2] == ["", "gating"]
    assert json.loads(encode(Problem(name, name)).encode("utf-8"))["message"] == written


@given(st.text(st.characters()), st.text(st.characters(categories=["Cs"]), min_size=1))
def test_no_text_keeps_a_message_from_being_sent(text, surrogates):
    history = advance(History(), ClickPlaced(TimeNs(int(FACTS.image_times[1])), (1.5, 2.5), "clicked"), FACTS)
    before = view(history, FACTS)
    after = replace(before, status=text, clicks=(replace(before.clicks[0], note=text + surrogates),))
    json.loads(encode(change_between(before, after, number=1)).encode("utf-8"))
    json.loads(encode(after).encode("utf-8"))


def test_numbers_that_are_not_finite_become_null():
    seen = RadarReturn(1.0, 2.0, 3.0, float("nan"), float("inf"), True, 2.0, 1.0, 2.0, 0.0, 26.6, 41.8)
    sent = json.loads(encode(Overlay(3, 5, (seen,), (OverlayGuess((4.0, 5.0), 6.0),))))
    returns = [[1.0, 2.0, 3.0, None, None, True, 2.0, 1.0, 2.0, 0.0, 26.6, 41.8]]
    assert sent == {"type": "overlay", "index": 3, "revision": 5, "returns": returns, "guesses": [[[4.0, 5.0], 6.0]]}


@pytest.mark.parametrize(
    ("message", "written"),
    [
        (Done(4), {"type": "done", "request": 4}),
        (Problem("a", "b"), {"type": "error", "message": "a", "hint": "b", "request": None}),
        (Progress("reading", 1, 2), {"type": "progress", "label": "reading", "done": 1, "total": 2}),
        (Overlay(1, 2, None, ()), {"type": "overlay", "index": 1, "revision": 2, "returns": None, "guesses": []}),
    ],
)
def test_a_message_to_the_page_carries_its_type(message, written):
    assert json.loads(encode(message)) == written


def test_a_image_travels_with_its_header_before_its_bytes():
    message = encode_frame(FrameHeader(3, 9, 640, 480, 0.5, "jpeg"), b"\xff\xd8image")
    wanted = {"index": 3, "request": 9, "width_px": 640, "height_px": 480, "scale": 0.5, "format": "jpeg"}
    (length,) = struct.unpack("<I", message[:4])
    assert json.loads(message[4 : 4 + length]) == wanted | {"rectified": False}
    assert message[4 + length :] == b"\xff\xd8image"


def test_the_types_of_the_page_are_those_of_the_program(project_root):
    kept = (project_root / "static" / "messages.d.ts").read_text(encoding="utf-8")
    made = runpy.run_path(str(project_root / "docs" / "make_page_types.py"))["declarations"]()
    assert kept == made, "run: python docs/make_page_types.py"
