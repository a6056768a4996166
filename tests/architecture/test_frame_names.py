"""Frame names agree in the whole program, and the checker finds those that do not."""

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import pytest


def load_checker() -> ModuleType:
    """Load the checker from this folder, which is not a package."""
    name = "frame_names"
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


frame_names = load_checker()


def findings_in(text: str) -> list[str]:
    return [finding.message for finding in frame_names.check_sources([frame_names.Source("snippet.py", text)])]


def test_frames_meet_in_the_whole_program(project_root):
    sources = [
        frame_names.Source(str(path.relative_to(project_root)), path.read_text(encoding="utf-8"))
        for folder in ("app", "calib_core", "benchmarks")
        for path in sorted((project_root / folder).rglob("*.py"))
    ]
    assert len(sources) > 20
    assert [str(finding) for finding in frame_names.check_sources(sources)] == []


@pytest.mark.parametrize(
    "text",
    [
        "points_camera = camera_from_radar @ points_radar",
        "points_camera_m = self.camera_from_radar @ scan.points_radar_m",
        "points_radar = camera_from_radar.inverse() @ points_camera",
        "camera_from_world = camera_from_radar @ radar_from_world",
        "radar_from_camera = camera_from_radar.inverse()",
        "camera_from_world = camera_from_radar @ world_from_radar.inverse()",
        "points_camera = camera_from_radar.rotation @ points_radar + camera_from_radar.translation_m",
        "points_camera = points_radar @ camera_from_radar.rotation.T",
        "camera_from_radar = nominal_camera_from_radar.perturbed(step)",
        "camera_from_radar = RigidTransform(camera_from_radar.rotation, camera_from_radar.translation_m)",
        "position_camera = camera_from_radar @ position_radar[None]",
        "f(camera_from_radar=calibration.camera_from_radar)",
        "points_camera = camera_from_radar @ anything",
        "anything = polar_from_cartesian(points_radar)",
        "rotation = matrix_from_quaternion_wxyz(q)",
        "title = 'radar_to_camera joint'",
        "def f(camera_from_radar): ...\nf(other_camera_from_radar)",
        "def camera_from_radar(x):\n    return x.radar_from_camera.inverse()",
        "f(ego_from_sensor=ego_from_camera)",
        "f(parent_from_child=camera_from_radar, points_source=points_radar)",
    ],
)
def test_frames_that_meet_pass(text):
    assert findings_in(text) == []


@pytest.mark.parametrize(
    "text",
    [
        "points_camera = radar_from_camera @ points_radar",
        "x = camera_from_radar @ points_camera",
        "x = self.camera_from_radar @ pair.points_camera_m",
        "points_radar = camera_from_radar @ points_radar",
        "points_radar_m = camera_from_radar @ anything",
        "points_camera = camera_from_radar.inverse() @ points_camera",
        "x = camera_from_radar @ camera_from_radar",
        "x = camera_from_radar.rotation @ camera_from_world.rotation",
        "x = camera_from_radar @ radar_from_world @ points_radar",
        "camera_from_radar = camera_from_world @ radar_from_world",
        "camera_from_radar = radar_from_camera",
        "camera_from_radar: RigidTransform = result.radar_from_camera",
        "radar_from_camera = result.camera_from_radar.perturbed(step)",
        "camera_from_radar, n = radar_from_camera, 3",
        "if (camera_from_radar := radar_from_camera): ...",
        "camera_from_radar = world_from_radar.inverse() @ world_from_camera",
        "camera_from_world = camera_from_radar @ unknown_from_world.inverse() @ radar_from_world.inverse()",
        "points_camera = points_radar @ camera_from_radar.rotation",
        "points_radar = points_camera @ radar_from_camera.rotation",
        "x = points_camera - points_radar",
        "x = camera_from_radar @ points_radar - points_radar",
        "x = RigidTransform(camera_from_radar.rotation, radar_from_camera.translation_m)",
        "position_radar_m = camera_from_radar.translation_m",
        "f(camera_from_radar=radar_from_camera)",
        "f(camera_from_radar=camera_from_radar.inverse())",
        "f(points_radar=points_camera)",
        "f(ego_from_sensor=camera_from_ego)",
        "def f(camera_from_radar): ...\nf(radar_from_camera)",
        "def camera_from_radar(x):\n    return x.radar_from_camera",
        "def f():\n    return camera_from_radar @ points_camera",
        "x = [camera_from_radar @ p.points_camera for p in pairs]",
        "x = camera_from_gizmo @ points_gizmo",
        "radar2cam = 1",
        "radar_to_camera = 1",
        "def f(camera_to_radar): ...",
        "f(cam2radar=1)",
        "x = result.radar_to_camera_rotation",
        "Rt = 1",
    ],
)
def test_a_frame_in_the_wrong_place_is_found(text):
    assert findings_in(text) != []


def test_a_finding_says_where_and_which_frames():
    text = "a = 1\n\nb = camera_from_radar @ points_camera\n"
    (finding,) = frame_names.check_sources([frame_names.Source("calib_core/x.py", text)])
    assert str(finding) == "calib_core/x.py:3: camera_from_radar @ points in camera: 'radar' meets 'camera'"


def test_a_positional_argument_is_compared_with_a_function_of_another_file():
    callee = frame_names.Source("a.py", "def project(points_radar, camera_from_radar): ...")
    caller = frame_names.Source("b.py", "project(points_radar, radar_from_camera)")
    assert [finding.source for finding in frame_names.check_sources([callee, caller])] == ["b.py"]
