"""What is fuzzed: everything that reads what a stranger may have written."""

import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np
from foxglove import messages as fox

from calib_core.deployment.placing import read_frames
from calib_core.errors import CalibrationError
from calib_core.interchange.cameras.files import read_camera
from calib_core.interchange.cameras.ros import camera_info_text
from calib_core.interchange.exporting import export
from calib_core.interchange.formats.registry import FORMATS
from calib_core.interchange.hypotheses.ranking import hypotheses_of
from calib_core.interchange.hypotheses.reading import as_imported, read_unstated
from calib_core.interchange.importing import read_any
from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.own.clicks_json import read_clicks
from calib_core.interchange.own.pairs_files import read_pairs
from calib_core.measurements import TimeNs
from calib_core.recordings import Recording, describe, first_image, inspect_recording
from calib_core.recordings.containers.copying import Losses, copied_file
from calib_core.recordings.containers.sources import Channel
from calib_core.recordings.field_words import parse_column_map
from calib_core.recordings.messages.decoding import decode
from calib_core.recordings.messages.definitions import definition_of, parse_definition
from calib_core.recordings.messages.foxglove import HEAD_BYTES, ros_head, ros_message
from calib_core.recordings.radar.column_plan import parse_radar_axes
from calib_core.recordings.radar.layouts import recognise
from calib_core.recordings.time.written_times import epoch_in_name, read_time
from calib_core.watching.baseline import read_baseline
from cocalib.session.applying import History, advance, settled
from cocalib.session.events import ClickExcluded, ClickPlaced, ClicksImported, Undo
from cocalib.session.file.guarded_folder import SessionFileError
from cocalib.session.file.session_file import open_session_file
from cocalib.session.state import RecordingFacts
from cocalib.view.build import view
from cocalib.web.messages.incoming import CursorMoved, FrameWanted, Hello, ImportWanted, ViewpointWanted, parse
from cocalib.web.port import guard
from cocalib.web.port.guard import Admissions
from tests.fuzz.box_targets import FILE_SEEDS, FILE_TOKENS, MESSAGE_SEEDS, box_file_reader, box_message_reader
from tests.fuzz.fuzzing import Target
from tests.fuzz.tree_target import SEEDS, tree_reader
from tests.unit.recordings.conftest import START_NS, Ros, plain_rows, write_rows
from tests.unit.recordings.containers.malformed import CASES, Kit

GOLDEN = Path(__file__).resolve().parents[1] / "golden"
FACTS = RecordingFacts("drive", START_NS + 100_000_000 * np.arange(20), width_px=640, height_px=480)
_LONGEST_SEED = 1 << 17


def _jpeg(width_px: int = 24, height_px: int = 16) -> bytes:
    image = np.arange(height_px * width_px * 3, dtype=np.uint8).reshape(height_px, width_px, 3)
    return bytes(cv2.imencode(".jpg", image)[1])


def _read_everything(path: Path) -> None:
    first_image([path])
    with inspect_recording(path) as recording:
        recording.radar_scans()
        for index in range(len(recording.image_times)):
            _swallow(lambda index=index: recording.image_bytes(index))
        describe(recording)
        _swallow(lambda: _copy(recording))


def _copy(recording: Recording) -> None:
    """Read a recording as an export into it does."""
    read_frames(recording)
    for source in recording.sources:
        file = copied_file(source)
        if file is not None:
            rows = {channel.id: source.index(channel.id) for channel in source.channels}
            for _ in file.messages(rows, Losses()):
                pass


def _swallow(call: Callable[[], object]) -> None:
    """Call; an error of ours is the right answer."""
    try:
        call()
    except CalibrationError as error:
        _require_words(error)


def _require_words(error: CalibrationError) -> None:
    assert str(error).strip(), "an error without a message"


def _file_target(name: str, suffix: str, seeds: Callable[[Path], Sequence[bytes]], *tokens: bytes) -> Target:
    """Open the input as a file with this suffix."""

    def run(data: bytes, folder: Path) -> None:
        path = folder / f"input{suffix}"
        path.write_bytes(data)
        _read_everything(path)

    return Target(name, run, seeds, tokens)


def _folder_target(name: str, suffix: str, seeds: Callable[[Path], Sequence[bytes]], *tokens: bytes) -> Target:
    """Open a folder with two files of the same content, stamped by their names."""

    def run(data: bytes, folder: Path) -> None:
        inside = folder / f"{name}-inputs"
        inside.mkdir(exist_ok=True)
        for second in (0, 1):
            (inside / f"170000000{second}.5{suffix}").write_bytes(data)
        _read_everything(inside)

    return Target(name, run, seeds, tokens)


def _containers(*kinds: str, cases: str) -> Callable[[Path], list[bytes]]:
    """Return small recordings of these containers, and every malformed one whose name begins with `cases`."""

    def seeds(folder: Path) -> list[bytes]:
        found = []
        for kind in kinds:
            ros = Ros(1 if kind.startswith("bag") else 2)
            path = write_rows(folder / f"seed-{kind}", ros, plain_rows(ros, _jpeg(), n=4), kind)
            files = [path] if path.is_file() else sorted(path.iterdir())
            found += [file.read_bytes() for file in files if file.suffix != ".yaml"]
        for number, (name, build) in enumerate(CASES.items()):
            if name.startswith(cases) and "bomb" not in name:
                inside = folder / f"case{number}"
                inside.mkdir()
                path = build(Kit(inside, _jpeg()))
                if path.is_file() and path.stat().st_size <= _LONGEST_SEED:
                    found.append(path.read_bytes())
        return found

    return seeds


def _fixed(*inputs: bytes) -> Callable[[Path], Sequence[bytes]]:
    return lambda _: inputs


def _pcd(_folder: Path) -> list[bytes]:
    head = (
        b"VERSION .7\nFIELDS x y z intensity\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    )
    points = np.arange(8, dtype="<f4").tobytes()
    return [head + b"DATA ascii\n1 2 3 4\n5 6 7 8\n", head + b"DATA binary\n" + points]


def _definition(data: bytes, _folder: Path) -> None:
    """Read a message definition, a zero byte, and a message."""
    text, _, payload = data.partition(b"\0")
    for encoding in ("ros1", "cdr"):
        definition = parse_definition("made_msgs/Up", text.decode("utf-8", "replace"), encoding)
        _swallow(lambda definition=definition: decode(definition, payload))
        _swallow(lambda definition=definition: recognise(definition, payload))


_DEFINITION = b"""std_msgs/Header header
made_msgs/Target[] targets
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: made_msgs/Target
float32 range  # [m]
float32 azimuth  # deg
int16 rcs
"""


_SPLIT = b"\0--\0"


def _foxglove(data: bytes, _folder: Path) -> None:
    definition, _, payload = data.partition(_SPLIT)
    for kind in ("PointCloud", "CompressedImage", "RawImage", "CameraCalibration"):
        for encoding in ("protobuf", "json"):
            channel = Channel(0, "/t", f"foxglove.{kind}", encoding, definition.decode("latin-1"), "")
            _swallow(lambda channel=channel: decode(definition_of(channel), ros_message(channel, payload)))  # type: ignore[misc]
            ros_head(channel, payload[:HEAD_BYTES])


def _foxglove_messages(_folder: Path) -> list[bytes]:
    kinds = fox.PackedElementFieldNumericType
    places = [fox.PackedElementField(name=name, offset=4 * i, type=kinds.Float32) for i, name in enumerate("xyz")]
    stamp = fox.Timestamp(1_700_000_000, 5)
    every = [
        fox.PointCloud(timestamp=stamp, frame_id="radar", point_stride=12, fields=places, data=bytes(36)),
        fox.CompressedVideo(timestamp=stamp, frame_id="camera", format="h264", data=b"\0\0\1\x65"),
        fox.RawImage(timestamp=stamp, width=2, height=1, encoding="bgr8", step=6, data=bytes(6)),
        fox.CameraCalibration(timestamp=stamp, width=2, height=1, D=[0.1], K=[1.0] * 9, P=[1.0] * 12),
    ]
    written = [type(one).get_schema().data + _SPLIT + one.encode() for one in every]
    columns = b'"fields":[{"name":"x","offset":0,"type":7}],"point_stride":4,"data":"AAAA"'
    text = b'{"timestamp":{"sec":1,"nsec":2},"frame_id":"r",' + columns + b"}"
    return [*written, _SPLIT + text]


def _exported(_folder: Path) -> list[bytes]:
    file = read_calibration((GOLDEN / "calibration-1.json").read_text(encoding="utf-8"))
    made = [(GOLDEN / "calibration-1.json").read_bytes()]
    for known in FORMATS:
        try:
            made.append(export(file, known.name, rectified=known.is_for_rectified).data)
        except CalibrationError:  # formats that are only read
            continue
    return [one if isinstance(one, bytes) else one.encode() for one in made]


def _unstated(data: bytes) -> None:
    """Read a file that states nothing, and what its first pose can mean."""
    file = read_unstated(data, "input")
    if file is not None:
        pose = file.poses[0]
        hypotheses = hypotheses_of(pose)
        found = as_imported(file, pose, hypotheses[0], by_hand=True)
        assert np.isfinite(found.camera_from_radar.as_matrix()).all()


def _unstated_files(_folder: Path) -> list[bytes]:
    matrix = np.array([[0.0, -1, 0, 0.1], [0, 0, -1, -0.3], [1, 0, 0, 0.05], [0, 0, 0, 1]])
    npy = io.BytesIO()
    np.save(npy, matrix)
    rotation, rows = matrix[:3, :3].ravel().tolist(), matrix.tolist()
    texts = (
        json.dumps({"radar": {"T_cam_radar": rows, "K": [[500, 0, 320], [0, 500, 240], [0, 0, 1]]}}),
        json.dumps({"rotation": [0.5, -0.5, 0.5, -0.5], "translation": {"x": 1, "y": 2, "z": 3}, "rvec": [1, 2, 1]}),
        f"sensors:\n- rotation: {rotation}\n  translation: [1, 2, 3]\n- {{x: 1, y: 2, z: 3, roll: 0, pitch: 0, yaw: 90}}\n",
        "0.1 0.2 0.3 0.5 -0.5 0.5 -0.5\n",
        "<rig><pose rvec='1 2 1' t='1 2 3'/></rig>",
    )
    return [npy.getvalue(), _MERGED, *(text.encode() for text in texts)]


def _own(data: bytes, _folder: Path) -> None:
    text = data.decode("utf-8", "surrogateescape")
    for read in (read_clicks, read_pairs, read_calibration, read_camera, read_baseline):
        _swallow(lambda read=read: read(text, source="input"))


def _own_files(_folder: Path) -> list[bytes]:
    text = (GOLDEN / "calibration-1.json").read_text(encoding="utf-8")
    camera = read_calibration(text).calibration.camera
    yaml = camera_info_text(camera, "camera")
    return [
        text.encode(),
        yaml.encode(),
        _PAIRS,
        _CLICKS,
        _BASELINE,
        _MERGED,
        b"%YAML:1.0\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n",
    ]


def _session(data: bytes, folder: Path) -> None:
    """Open a session whose journal is the input, and its copy the rest after a zero byte."""
    inside = folder / "input.cocalib-session"
    inside.mkdir(exist_ok=True)
    for old in inside.iterdir():
        old.unlink()
    journal, zero, copy = data.partition(b"\0")
    (inside / "journal.jsonl").write_bytes(journal)
    if zero:
        (inside / "journal-copy.jsonl").write_bytes(copy)
    try:
        open_session_file(inside, FACTS).close()
    except SessionFileError:
        assert (inside / "journal.jsonl").read_bytes() == journal, "a refused session was changed"


def _sessions(folder: Path) -> list[bytes]:
    session = open_session_file(folder / "seed.cocalib-session", FACTS)
    history = session.restored.history
    times = [TimeNs(int(time)) for time in FACTS.image_times[:4]]
    for step in (*(ClickPlaced(time, (10.5, 20.25), "clicked") for time in times), ClickExcluded("c2", True), Undo()):
        history = advance(history, step, FACTS)
        session.append(step, history)
    session.close()
    files = [(folder / "seed.cocalib-session" / name).read_bytes() for name in ("journal.jsonl", "journal-copy.jsonl")]
    return [files[0], b"\0".join(files)]


def _request(data: bytes, _folder: Path) -> None:
    """Ask the guard: the path in the first line, headers in the others."""
    path, *lines = data.decode("latin-1").split("\n")
    headers: dict[str, list[str]] = {}
    for line in lines:
        name, _, value = line.partition(": ")
        headers.setdefault(name.lower(), []).append(value)
    doorkeeper = guard.Guard(Admissions("a"), host="127.0.0.1", token="t" * 32)
    verdict = doorkeeper.check(guard.Request(path, headers))
    assert not isinstance(verdict, guard.Allowed), "a request without the cookie was allowed"


def _words(data: bytes, _folder: Path) -> None:
    """Read what a user types or a file is called: options, dates, names."""
    text = data.decode("utf-8", "replace")
    for read in (lambda: parse_column_map([text]), lambda: parse_radar_axes(text), lambda: read_time(text)):
        _swallow(read)
    epoch_in_name(text)


def _messages(data: bytes, _folder: Path) -> None:
    """Take the lines as what a page sends, one message after the other, and look at the result."""
    history = History()
    for line in data.split(b"\n")[:20]:
        try:
            command = parse(line).command
            if not isinstance(command, Hello | FrameWanted | CursorMoved | ViewpointWanted | ImportWanted):
                history = advance(history, settled(command, history.present), FACTS)
            elif isinstance(command, ImportWanted):
                history = advance(history, ClicksImported.of(read_clicks(command.text, command.name)), FACTS)
        except CalibrationError as error:
            _require_words(error)
    view(history, FACTS, None)


_MERGE = b"<<: *a"
_MERGED = b"a: &a {x: 1, y: [2, 3]}\nb: &b {<<: [*a, *a], y: 4}\nc: [*b, {<<: *b}, 0x7fffffffffffffffffff]\n"
_PAIRS = (
    b'{"schema":"cocalib/pairs-1","camera":{"model":"pinhole","width_px":640,"height_px":480,'
    b'"matrix_px":[[500,0,320],[0,500,240],[0,0,1]]},'
    b'"pairs":[{"id":"p1","radar_m":[5,1,-0.5],"pixel_px":[212.9,239.4],"alternatives_radar_m":[[5,2,0]],"sigma_px":2}]}'
)
_BASELINE = json.dumps({
    "schema": "cocalib/baseline-1", "calibration_sha256": "a" * 64, "recording": "a.bag", "image_size_px": [640, 480],
    "start": {"sec": 1, "nanosec": 5}, "end": {"sec": 2, "nanosec": 5}, "backgrounds": ["/9j/AAAA"],
    "still_returns": {"polar": [[9.5, 0.25, 0.0]], "spreads_rad": [[0.01, 0.02]]},
    "traffic": {"labels": ["car"], "factors": [[[1.0, 1.0], [1.0, 1.0]]], "middle": [0.0] * 5, "gradient": [0.0] * 5,
                "information": [[float(i == j) for i in range(5)] for j in range(5)], "passages": [3], "seconds": 60.0},
}).encode()  # fmt: skip
_CLICKS = b'{"schema":"cocalib/clicks-1","clicks":[{"id":"c1","image_time":{"sec":1700000000,"nanosec":5},"pixel_px":[1.5,2]}]}'
_REQUESTS = (b"/?token=x\nHost: 127.0.0.1:8080", b"/ws/a\nHost: localhost\nUpgrade: websocket\nOrigin: http://x")
_TYPED = (b"x=posX:m", b"forward,right,up,degrees", b"2024-05-01T12:00:00.25+02:00", b"img_1715938951.208764")
_CSV = (
    b"time_ns,x_m,y_m,z_m,doppler_mps,snr_db\n1700000000000000000,1,2,3,0.1,20\n1700000000100000000,1,2,3,,20\n",
    b"timestamp [s];range [m];azimuth [deg]\n1700000000,5;3,2;10\n",
    b"2024/05/17/09:42:31.20,x\n",
    b'date,time,x [cm],y [mm],v [km/h]\n2024-05-17,09:42:31.25,"[1, 2]","[3, 4]","[0, 1]"\n2024-05-17,09:42:31.35,[1],[2],[3]\n',
)
_JSON_LINES = (
    b'{"time_ns":1700000000000000000,"x_m":1,"y_m":2,"z_m":3,"doppler_mps":0.5,"id":null}\n' * 3,
    b'{"header":{"stamp":{"sec":1700000000,"nanosec":5}},"detections":[{"position":{"x":1,"y":2,"z":3},"snr_db":9}]}\n'
    * 2,
    b'[{"timestamp_us":1700000000000000,"x_m":[1,2],"y_m":[3,4],"z_m":[0,0]}]',
)
_CLICK = b'{"type":"click_placed","image_time":{"sec":1700000000,"nanosec":%d},"pixel_px":[1.5,2.5],"request":3}'
_MESSAGES = (
    b"\n".join(
        (
            *(_CLICK % (100_000_000 * number) for number in range(5)),
            b'{"type":"click_moved","id":"c1","pixel_px":[1.5,2.5]}',
            b'{"type":"click_excluded","id":"c2","excluded":true}',
            b'{"type":"undo"}\n{"type":"redo"}',
            b'{"type":"click_removed","id":"c1"}',
        )
    ),
    b'{"type":"options_changed","options":{"noise":{"sigma_px":3},"method":"paper"}}\n{"type":"cleared"}',
    b'{"type":"hello"}\n{"type":"cursor","index":7}\n{"type":"viewpoint","viewpoint":"above"}',
    b'{"type":"import_clicks","text":"{\\"schema\\":\\"cocalib/clicks-1\\",\\"clicks\\":[]}","name":"a.json"}',
)

TARGETS: tuple[Target, ...] = (
    _file_target("bag", ".bag", _containers("bag", "bag-lz4", "bag-bz2", cases="bag_"),
                 b"#ROSBAG V2.0\n", b"conn=", b"chunk_pos="),
    _file_target("mcap", ".mcap", _containers("mcap", "mcap-zstd", cases="mcap_"), b"\x89MCAP0\r\n", b"zstd", b"lz4"),
    _file_target("db3", ".db3", _containers("db3", "db3-zstd", cases="db3_"), b"SQLite format 3\0", b"messages", b"topics"),
    _file_target("csv", ".csv", _fixed(*_CSV), b"time_ns", b"x_m", b"y_m", b"range_m", b"azimuth_deg", b",", b";", b"\t"),
    _file_target("json-lines", ".jsonl", _fixed(*_JSON_LINES), b'"points"', b'"x_m"', b"null", b"[[", b"1e999", b"NaN"),
    _folder_target("pcd", ".pcd", _pcd, b"FIELDS", b"DATA ascii\n", b"WIDTH", b"COUNT", b"rgb"),
    _folder_target("bin", ".bin", _fixed(np.array([3, 4, 0, 1, 5, 9, 0.9, 0], "<f4").tobytes(), bytes(28))),
    _folder_target("jpeg", ".jpg", _fixed(_jpeg(), _jpeg(8, 8)), b"\xff\xd8", b"\xff\xe1", b"\xff\xd9", b"\xff\xc0"),
    Target("definition", _definition, _fixed(_DEFINITION + b"\0" + bytes(64), b"float64 x\nfloat64 y\n\0")),
    Target("foxglove", _foxglove, _foxglove_messages, (b'"pose":{', b'"data":"', b"foxglove.")),
    Target("calibration", lambda data, _: _swallow(lambda: read_any(data, "input")), _exported,
           (_MERGE, b"NaN", b"xyzw", b"1e308")),
    Target("frame-tree", tree_reader(_swallow), _fixed(*SEEDS, _MERGED),
           (_MERGE, b"${", b"&x", b"xacro:", b"<origin", b"1e999", b"---\n")),
    Target("unstated", lambda data, _: _swallow(lambda: _unstated(data)), _unstated_files,
           (_MERGE, b"NaN", b"rpy", b"rvec", b"1e308")),
    Target("own-files", _own, _own_files,
           (_MERGE, b"[" * 99, b"9" * 99, b'"pairs"', b'"clicks"', b'"cocalib/pairs-1"', b'"cocalib/clicks-1"')),
    Target("boxes", box_file_reader(_swallow), _fixed(*FILE_SEEDS), FILE_TOKENS),
    Target("box-messages", box_message_reader(_swallow), _fixed(*MESSAGE_SEEDS), (b"bbox", b"results", b"points")),
    Target("session", _session, _sessions, (b'"n"', b'"step"', b'"undo"', b"\n")),
    Target("messages", _messages, _fixed(*_MESSAGES), (b'"type"', b'"request"', b'"click_moved"', b'"import"')),
    Target("request", _request, _fixed(*_REQUESTS), (b"%2e", b"//", b"token=", b"Cookie: ", b"cocalib=", b"Origin: ")),
    Target("words", _words, _fixed(*_TYPED), (b"deg", b":", b"=", b"-", b"T", b"Z", b"+02:00")),
)  # fmt: skip
"""By name; a new reader of foreign bytes gets one here."""
