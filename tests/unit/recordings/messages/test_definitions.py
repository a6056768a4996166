"""Definitions are parsed, never executed; messages decode as rosbags decodes them."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from calib_core.errors import MessageError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import inspect_recording
from calib_core.recordings.containers.sources import Channel
from calib_core.recordings.messages.decoding import Message, decode
from calib_core.recordings.messages.definitions import Field, definition_of, parse_definition

START_NS = 1_700_000_000 * NS_PER_S


def test_a_definition_with_every_feature_of_the_language_is_parsed():
    text = """
# a comment
string<=10 name "a # default = x"   # another
int32[<=5] bounded
uint8 WITH_VALUE=3
string TEXT = "quoted # not a comment"
float64[3] fixed 
Header header
Other[] others
time when
char[] letters [1, 2]
================================================================================
MSG: test_msgs/Other
bool flag true
"""
    definition = parse_definition("test_msgs/Thing", text, "ros1")
    assert definition.fields == (
        Field("name", "string"),
        Field("bounded", "int32", 0),
        Field("fixed", "float64", 3),
        Field("header", "std_msgs/Header"),
        Field("others", "test_msgs/Other", 0),
        Field("when", "time"),
        Field("letters", "char", 0),
    )


INJECTIONS = [
    "float32 x\n__import__('os').system('touch PWNED') y",
    "float32 x;import os",
    "float32 x'); open('PWNED','w') #",
    "float32 __class__[__import__('os').system('touch PWNED')]",
    "float32[__import__('os').system('touch PWNED')] x",
    "uint8 A=__import__('os').system('touch PWNED')\nfloat32 x",
    "float32 x __import__('os').system('touch PWNED')",
    "string NAME='''\n\"\"\"\nimport os; os.system('touch PWNED')\n\"\"\"'''",
    "float32 x\n====\nMSG: a/B; import os\nfloat32 y",
    "float32 x\n====\nMSG: ../../etc/passwd\nfloat32 y",
    "float32 exec\nfloat32 lambda\nfloat32 import",
]


@pytest.mark.parametrize("text", INJECTIONS)
def test_code_in_a_definition_is_never_run(text, ros1, write, tmp_path, monkeypatch, plain, jpeg):
    """The payload is in the bag as a recorder would write it; opening either refuses it or decodes it as data."""
    monkeypatch.chdir(tmp_path)
    before = set(sys.modules)
    ros1.define("odd_msgs/msg/Odd", "Header header\nfloat32 x\n")
    odd = ros1.new("odd_msgs/msg/Odd", header=ros1.header(START_NS), x=1.0)

    def with_payload(definition: str) -> str:
        return definition.replace("float32 x\n", text + "\n")

    original = type(ros1.store).generate_msgdef

    def poisoned(store: Any, name: str, *args: Any, **options: Any) -> Any:
        definition, digest = original(store, name, *args, **options)
        return (with_payload(definition), digest) if "odd" in name else (definition, digest)

    monkeypatch.setattr(type(ros1.store), "generate_msgdef", poisoned)
    path = write(ros1, [*plain(ros1, jpeg), ("/odd", START_NS, odd)])
    assert text.encode() in path.read_bytes()
    with inspect_recording(path) as recording:
        assert len(recording.radar_scans()) == 20
    assert not (tmp_path / "PWNED").exists()
    assert not any("odd_msgs" in name for name in set(sys.modules) - before)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("float32 x y z\nno!", "a line that is not a field: 'no!'"),
        ("Unknown x", "uses test_msgs/Unknown, which is not defined in the recording"),
        ("Thing again", "contains itself"),
        ("float32 x\nuint8 x", "has two fields of one name"),
        ("float64[99999999] x", "a fixed array of 99999999 elements; at most"),
        ("float32 x\n=====\nnonsense", "begins with 'nonsense' instead of MSG:"),
    ],
)
def test_invalid_definitions_are_refused_with_a_clear_error(text, words):
    with pytest.raises(MessageError) as caught:
        parse_definition("test_msgs/Thing", text, "ros1")
    assert words in str(caught.value)


def test_a_definition_of_blanks_is_none():
    known = Channel(0, "/radar", "sensor_msgs/PointCloud2", "ros1", " \n", "msg")
    assert "point_step" in definition_of(known).names
    with pytest.raises(MessageError, match="topic /radar"):
        definition_of(replace(known, type="my_msgs/Detections"))


def test_a_definition_in_idl_is_parsed():
    text = """
================================================================================
IDL: test_msgs/msg/Thing
module test_msgs { module msg {
  struct Thing { std_msgs::msg::Header header; sequence<float> values; float fixed[3]; string name; };
}; };
"""
    header = (
        "module std_msgs { module msg { struct Header { builtin_interfaces::msg::Time stamp; string frame_id; }; }; };"
    )
    time = "module builtin_interfaces { module msg { struct Time { long sec; unsigned long nanosec; }; }; };"
    line = "=" * 80
    whole = f"{text}\n{line}\nIDL: std_msgs/msg/Header\n{header}\n{line}\nIDL: builtin_interfaces/msg/Time\n{time}\n"
    definition = parse_definition("test_msgs/Thing", whole, "cdr", form="idl")
    assert definition.fields == (
        Field("header", "std_msgs/Header"),
        Field("values", "float32", 0),
        Field("fixed", "float32", 3),
        Field("name", "string"),
    )
    assert definition.stamp_offset == 4


# -- decoding against rosbags
PRIMITIVES = ("bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64")
element = st.lists(st.sampled_from(PRIMITIVES), min_size=1, max_size=4)


class Random:
    """Random messages of a random definition, built with rosbags."""

    def __init__(self, fields: list[tuple[str, str]], inner: list[str], inner_text: bool, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.inner = {f"f{i}": kind for i, kind in enumerate(inner)} | ({"text": "string"} if inner_text else {})
        self.fields = fields
        body = "\n".join(f"{kind}{array} m{i}" for i, (kind, array) in enumerate(fields))
        inner_body = "\n".join(f"{kind} {name}" for name, kind in self.inner.items())
        self.text = f"{body}\n{'=' * 80}\nMSG: t_msgs/Inner\n{inner_body}\n"
        self.store = get_typestore(Stores.EMPTY)
        self.store.register(get_types_from_msg(self.text, "t_msgs/msg/Outer"))

    def number(self, kind: str) -> Any:
        if kind == "string":
            return "abcdefgh"[: self.rng.integers(0, 8)]
        if kind == "bool":
            return bool(self.rng.integers(0, 2))
        return float(np.float32(self.rng.normal())) if "float" in kind else int(self.rng.integers(0, 100))

    def value(self, kind: str) -> Any:
        if kind != "Inner":
            return self.number(kind)
        return self.store.types["t_msgs/msg/Inner"](**{name: self.number(k) for name, k in self.inner.items()})

    def filled(self, kind: str, array: str) -> Any:
        if not array:
            return self.value(kind)
        count = int(self.rng.integers(0, 4)) if array == "[]" else int(array[1])
        values = [self.value(kind) for _ in range(count)]
        return values if kind in ("Inner", "string") else np.array(values, dtype=kind)

    def message(self) -> Any:
        values = {f"m{i}": self.filled(*field) for i, field in enumerate(self.fields)}
        return self.store.types["t_msgs/msg/Outer"](**values)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(
        st.one_of(
            st.tuples(st.sampled_from([*PRIMITIVES, "string"]), st.sampled_from(["", "[]", "[3]"])),
            st.tuples(st.just("Inner"), st.sampled_from(["", "[]", "[2]"])),
        ),
        min_size=1,
        max_size=6,
    ),
    element,
    st.booleans(),
    st.sampled_from(["ros1", "cdr"]),
    st.integers(0, 2**32 - 1),
)
def test_messages_of_any_definition_decode_as_rosbags_decodes_them(fields, inner, inner_text, encoding, seed):
    made = Random(fields, inner, inner_text, seed)
    message = made.message()
    write = made.store.serialize_ros1 if encoding == "ros1" else made.store.serialize_cdr
    payload = bytes(write(message, "t_msgs/msg/Outer"))
    found = decode(parse_definition("t_msgs/Outer", made.text, encoding), payload)
    for i, (kind, array) in enumerate(fields):
        same(found[f"m{i}"], getattr(message, f"m{i}"), kind if not array else kind + "[]")


def same(found: Any, expected: Any, kind: str) -> None:
    if kind == "Inner[]":
        if isinstance(found, np.ndarray):
            for name in found.dtype.names or ():
                assert found[name].tolist() == [getattr(one, name) for one in expected]
        else:
            assert len(found) == len(expected)
            for one, other in zip(found, expected, strict=True):
                same(one, other, "Inner")
    elif kind == "Inner":
        assert isinstance(found, Message)
        assert dict(found.values) == {name: getattr(expected, name) for name in found.values}
    elif kind.endswith("[]"):
        assert list(found) == list(expected)
    else:
        assert found == expected


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b"", "does not fit its definition"),
        (b"\0\1\0\0" + b"\xff" * 12, "does not fit its definition"),
        (b"\0\3\0\0" + bytes(40), "is not plain CDR"),
    ],
)
def test_bytes_that_do_not_fit_are_refused(payload, words):
    encoding = "ros1" if not payload else "cdr"
    definition = parse_definition("t_msgs/List", "float64[] values\nuint32 more", encoding)
    with pytest.raises(MessageError, match=words):
        decode(definition, payload)


def test_a_count_of_billions_is_refused_before_memory_is_allocated():
    definition = parse_definition("t_msgs/List", "Inner[] values\n====\nMSG: t_msgs/Inner\nstring text", "ros1")
    with pytest.raises(MessageError, match="claims 4294967295 elements in a message of 24 bytes"):
        decode(definition, b"\xff\xff\xff\xff" + bytes(20))


# Messages with standard field names of other types: a problem of their topic only.


ODD = {
    "Image": ("string height\nstring width\nuint32 encoding\nstring step\nfloat32[] data\n", "image"),
    "Compressed": ("uint32 format\nuint8[] data\n", "image"),
    "Wide": ("string format\nfloat64[] data\n", "image"),
    "Cloud": (
        "string height\nuint32 width\nstring fields\nbool is_bigendian\nuint32 point_step\nuint32 row_step\nstring data\n",
        "other",
    ),
    "Channels": ("float32[] points\nstring channels\n", "other"),
    "Info": ("string height\nuint32 width\nstring distortion_model\nfloat64[] D\nstring K\n", "camera-info"),
}


@pytest.mark.parametrize("name", ODD)
def test_fields_of_the_wrong_type_are_explained(name, ros, write, plain, jpeg):
    text, kind = ODD[name]
    odd = ros.define(f"odd_msgs/msg/{name}", f"Header header\n{text}")
    values = {}
    for line in text.splitlines():
        field_type, field = line.split()
        if field_type.endswith("[]"):
            values[field] = np.ones(3, dtype=field_type[:-2])
        else:
            values[field] = "text" if field_type == "string" else field_type == "bool" or 7
    message = ros.new(odd, header=ros.header(START_NS), **values)
    path = write(ros, [*plain(ros, jpeg), ("/camera/other/camera_info", START_NS, message)])
    with inspect_recording(path) as recording:
        (topic,) = [topic for topic in recording.topics if topic.name.startswith("/camera/other")]
        assert topic.kind == kind
        assert kind == "camera-info" or topic.problem is not None
        assert len(recording.radar_scans()) == len(recording.image_times) == 20


def test_camera_info_of_an_odd_layout_gives_no_camera_and_says_why(ros, write, plain, jpeg):
    odd = ros.define("odd_msgs/msg/Info", f"Header header\n{ODD['Info'][0]}")
    info = ros.new(odd, header=ros.header(START_NS), height="x", width=1, distortion_model="", D=np.zeros(5), K="no")
    rows = [row for row in plain(ros, jpeg) if "info" not in row[0]]
    with inspect_recording(write(ros, [*rows, ("/camera/camera_info", START_NS, info)])) as recording:
        assert recording.camera() is None
        assert [warning.code for warning in recording.warnings] == ["camera-unreadable"]
        message = recording.warnings[0].facts["message"]
        assert "is not 9 numbers" in message or "is not an array" in message
