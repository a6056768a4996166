"""`import calib_core as cc`: every public name is there, nothing is imported before it is used, and the examples run."""

import ast
import json
import subprocess
import sys
from typing import Any

import numpy as np
import pytest

import calib_core as cc
from benchmarks.simulated_pairs import SimulatedPairs, simulate_pairs
from calib_core.measurements import TimeNs


@pytest.fixture(scope="module")
def simulated() -> SimulatedPairs:
    return simulate_pairs(20, rng=np.random.default_rng(8), noise="ti")


@pytest.fixture(scope="module")
def solved(simulated: SimulatedPairs) -> cc.Calibration:
    return cc.calibrate_pairs(simulated.pairs, simulated.camera).unwrap()


def test_the_public_names_are_sorted_complete_and_documented():
    assert list(cc.__all__) == sorted(cc.__all__)
    assert dir(cc) == list(cc.__all__)
    for name in cc.__all__:
        assert (getattr(cc, name).__doc__ or "").strip(), name


def test_the_names_for_type_checkers_are_those_that_can_be_imported(project_root):
    module = ast.parse((project_root / "calib_core" / "__init__.py").read_text(encoding="utf-8"))
    guarded = next(node for node in module.body if isinstance(node, ast.If))
    imported = {
        f"{node.module}.{alias.name}"
        for node in guarded.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    lazy = {f"calib_core.{module}.{name}" for name, module in cc._MODULE_OF.items()}
    assert imported == lazy
    assert {name.rpartition(".")[2] for name in lazy} == set(cc.__all__)


def test_importing_the_package_imports_nothing_else():
    code = "import sys; import calib_core; print(*(m for m in sys.modules if m.startswith(('calib_core.', 'numpy'))))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_a_misspelt_name_is_refused_with_a_clear_error():
    with pytest.raises(AttributeError, match=r"no attribute 'calibrat'; its public names are in calib_core\.__all__"):
        _ = cc.calibrat


def test_a_calibration_reads_back_from_its_file(solved, tmp_path):
    path = tmp_path / "calibration.json"
    cc.write_calibration(path, solved, frames=cc.FrameNames("radar_front", "cam_optical"))
    file = cc.read_calibration(path)
    assert file.frames.radar == "radar_front"
    assert file.calibration.camera_from_radar.as_matrix().tobytes() == solved.camera_from_radar.as_matrix().tobytes()
    cc.write_calibration(tmp_path / "again.json", file)
    assert (tmp_path / "again.json").read_bytes() == path.read_bytes()


def test_pairs_and_clicks_read_back_from_their_files(simulated, tmp_path):
    cc.write_pairs(tmp_path / "pairs.json", cc.PairsFile(simulated.camera, simulated.pairs))
    assert [pair.id for pair in cc.read_pairs(tmp_path / "pairs.json").pairs] == [pair.id for pair in simulated.pairs]
    clicks = (cc.ReflectorClick(TimeNs(7), "c1", 3.0, 4.0),)
    cc.write_clicks(tmp_path / "clicks.json", clicks)
    assert cc.read_clicks(tmp_path / "clicks.json") == clicks


def test_a_calibration_is_exported_and_the_file_checked(solved, tmp_path):
    exported = cc.export(solved, "opencv")
    (tmp_path / "camera.yml").write_bytes(exported.data)
    assert cc.check(tmp_path / "camera.yml").verdict == "right"
    assert cc.check(tmp_path / "camera.yml", against=solved).ok
    assert cc.check(solved).verdict == "right"


@pytest.mark.parametrize("read", [cc.read_pairs, cc.read_clicks, cc.read_calibration])
def test_files_that_cannot_be_read_are_refused_in_one_line(read, tmp_path):
    (tmp_path / "binary.json").write_bytes(b"\xff\xfe\x00\x9c")
    for name, words in (("missing.json", "no such file or folder"), ("binary.json", "not a text file")):
        with pytest.raises(cc.InputError, match=words) as refusal:
            read(tmp_path / name)
        assert str(tmp_path / name) in str(refusal.value)
        assert "\n" not in str(refusal.value)


def test_the_readmes_example_runs_as_it_stands(simulated, project_root, tmp_path, monkeypatch):
    readme = (project_root / "README.md").read_text(encoding="utf-8")
    (example,) = [part.partition("```")[0] for part in readme.split("```python\n")[1:]]
    assert len([line for line in example.splitlines() if line.strip() and not line.startswith("#")]) <= 10
    camera = simulated.camera
    np.savetxt(
        tmp_path / "points.csv", [pair.candidates[0].position_radar_m for pair in simulated.pairs], delimiter=","
    )
    np.savetxt(tmp_path / "pixels.csv", [pair.pixel_px for pair in simulated.pairs], delimiter=",")
    content = {"model": camera.model, "width_px": camera.width_px, "height_px": camera.height_px}
    content |= {"matrix_px": camera.matrix_px.tolist(), "distortion": camera.distortion.tolist()}
    (tmp_path / "camera.json").write_text(json.dumps(content))
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    exec(example, names)
    assert isinstance(names["calibration"], cc.Calibration)
    assert (tmp_path / "calibration.json").is_file()
