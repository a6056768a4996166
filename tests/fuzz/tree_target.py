"""A frame tree's file in the fuzzer: read, and patched with every joint that lies between two of its frames."""

from collections.abc import Callable
from pathlib import Path

from calib_core.interchange.own.calibration_json import read_calibration
from calib_core.interchange.trees.frame_choice import WantedFrames
from calib_core.interchange.trees.patching import patched
from calib_core.interchange.trees.reading import TreeFile, read_tree
from tests.unit.interchange.trees import vehicles

_GOLDEN = Path(__file__).resolve().parents[1] / "golden/calibration-1.json"
_SCRIPT = (
    "ros2 run tf2_ros static_transform_publisher --x=1.2 --roll 0.1 --frame-id base --child-frame-id 'radar'\n"
    "ros2 run tf2_ros static_transform_publisher 1 0 0 0.5 -0.5 0.5 0.5 base camera_optical &\n"
)
_LAUNCH = (
    '<launch><node type="static_transform_publisher" args="1 0 0.5 0 0 0 base radar 100"/>\n'
    '<node exec="static_transform_publisher" args="--z 1 --frame-id base --child-frame-id &quot;cam&quot;"/></launch>\n'
)
_PYTHON = (
    "def generate_launch_description():\n"
    "    a = Node(executable='static_transform_publisher', arguments=['1', '0', '0', '0', '0', '0', 'base', 'radar'])\n"
    "    b = Node(executable='static_transform_publisher', arguments=['--x', '2', '--frame-id', 'base',\n"
    "             '--child-frame-id', 'camera'])\n"
)
_RIG = (
    '{"rig": {"sensors": [{"name": "r", "protocol": "radar", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 1], '
    '"t": [1, 0, 0]}}, {"name": "c", "protocol": "camera", "nominalSensor2Rig_FLU": {"roll-pitch-yaw": [0, 0, 0], '
    '"t": [0, 0, 1]}}]}}'
)
_NUSCENES = (
    '[{"token": "a", "sensor_token": "s", "translation": [0, 0, 1], "rotation": [1, 0, 0, 0], "camera_intrinsic": []},\n'
    '{"token": "b", "sensor_token": "t", "translation": [0, 0, 1], "rotation": [1, 0, 0, 0], '
    '"camera_intrinsic": [[1, 0, 1], [0, 1, 1], [0, 0, 1]]}]'
)

SEEDS = tuple(
    text.encode()
    for text in (
        vehicles.CAR_URDF,
        vehicles.REALSENSE_URDF,
        vehicles.REALSENSE_ECHO,
        vehicles.SENSORS_CALIBRATION,
        *(_SCRIPT, _LAUNCH, _PYTHON, _RIG, _NUSCENES),
    )
)


def tree_reader(swallow: Callable[[Callable[[], object]], None]) -> Callable[[bytes, Path], None]:
    """Return what the fuzzer calls: reads a tree, and patches it between its first frame and the others."""
    calibration = read_calibration(_GOLDEN.read_text(encoding="utf-8"))

    def read(data: bytes, _folder: Path) -> None:
        files = [TreeFile(data, "input")]
        frames: list[str] = []
        swallow(lambda: frames.extend(read_tree(files).frames))
        for frame in frames[1:4]:
            swallow(lambda frame=frame: patched(files, (), calibration, WantedFrames(frames[0], frame)))

    return read
