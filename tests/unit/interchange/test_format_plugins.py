"""Formats of other installed packages are written, read and listed, or skipped with one line if they are broken."""

import logging
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from calib_core.errors import InputError
from calib_core.interchange.check.report import check
from calib_core.interchange.exporting import export
from calib_core.interchange.format import imported
from calib_core.interchange.formats.registry import (
    CAMERA_ONLY,
    FORMATS,
    GROUP,
    format_named,
    plugin_formats,
    written_formats,
)
from calib_core.interchange.importing import read_any
from cocalib.cli import run
from cocalib.web.channel.export_preview import export_preview
from cocalib.web.exports import format_rows
from tests.fake_distribution import installing

PARAMETERS = '''
    """A YAML of parameters, as `ros2 param dump` writes one."""

    import numpy as np

    from calib_core.interchange import Content, Format, ImportedCalibration, Reads, WrittenPose


    def write(file):
        rows = file.calibration.camera_from_radar.as_matrix().ravel().tolist()
        return f"/radar_camera:\\n  ros__parameters:\\n    camera_from_radar: {rows}\\n"


    def recognizes(content: Content):
        return "ros__parameters" in content.mapping.get("/radar_camera", {})


    def read(content, source):
        rows = np.reshape(content.mapping["/radar_camera"]["ros__parameters"]["camera_from_radar"], (4, 4))
        return ImportedCalibration("acme-params", WrittenPose("matrix", rows[:3, :3], rows[:3, 3], "camera_from_radar"))


    PARAMETERS = Format(
        name="acme-params", title="ROS 2 parameters", numbers="rows of camera_from_radar", file_name="params.yaml",
        camera="none", comment="none", write=write, reads=Reads(recognizes, read), notes=("contains the pose only",),
    )
'''

BINARY = """
    import numpy as np

    from calib_core.interchange import Format, ImportedCalibration, Reads, WrittenPose


    def write(file):
        return b"\\xff\\xfdACME" + file.calibration.camera_from_radar.as_matrix().tobytes()


    def recognizes(content):
        return content.data.startswith(b"\\xff\\xfdACME")


    def read(content, source):
        rows = np.frombuffer(content.data[6:]).reshape(4, 4)
        return ImportedCalibration("binary", WrittenPose("matrix", rows[:3, :3], rows[:3, 3], "camera_from_radar"))


    BINARY = Format(
        name="binary", title="Binary", numbers="rows", file_name="pose.bin", camera="none", comment="none", write=write,
        reads=Reads(recognizes, read),
    )
"""

Install = Callable[..., Path]


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    source = (PARAMETERS, "PARAMETERS")
    yield from installing(tmp_path / "site-packages", monkeypatch, "acme-params", GROUP, plugin_formats, *source)


def only_line(caplog: pytest.LogCaptureFixture) -> str:
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    return record.getMessage()


def test_a_format_of_an_installed_package_is_written_read_and_checked(installed, file):
    installed()

    written = export(file, "acme-params")

    assert written.file_name == "params.yaml"
    assert read_any(written.data).format == "acme-params"
    assert check(read_any(written.data), against=imported(file)).verdict == "right"


def test_it_is_listed_after_ours_by_the_command_and_on_the_page(installed, file, capsys):
    installed()

    assert [known.name for known in written_formats()] == [
        *(known.name for known in (*FORMATS, *CAMERA_ONLY)),
        "acme-params",
    ]
    assert (format_rows()[-1].key, format_rows()[-1].label) == ("acme-params", "ROS 2 parameters")
    assert export_preview(file, "acme-params", "", "drive").check_is_good
    assert run(["export", "--to", "list"]) == 0
    assert capsys.readouterr().out.splitlines()[-2].split(None, 1) == ["acme-params", "ROS 2 parameters"]


def test_one_entry_point_may_name_several(installed):
    installed(
        module=f"{PARAMETERS}\n    from dataclasses import replace\n    BOTH = (PARAMETERS, replace(PARAMETERS, name='two'))\n",
        value="BOTH",
    )

    assert [known.name for known in written_formats()[-2:]] == ["acme-params", "two"]


def test_a_binary_format_is_recognized_by_its_bytes_and_previewed_by_its_size(installed, file):
    installed(BINARY, "BINARY")

    preview = export_preview(file, "binary", "", "drive")

    assert (preview.is_binary, preview.check_is_good) == (True, True)
    assert preview.text == f"binary, {preview.size_bytes:,} bytes\n"


@pytest.mark.parametrize(
    ("module", "value", "words"),
    [
        ("import nothing_of_this_name", "X", "acme_params:X cannot be loaded (ModuleNotFoundError: No module named"),
        ("raise SystemExit(3)", "X", "cannot be loaded (SystemExit: 3)"),
        ("X = (", "X", "cannot be loaded (SyntaxError"),
        ("", "X", "cannot be loaded (AttributeError"),
        ("X = 3", "X", "acme_params:X is neither a Format nor a tuple of them"),
        (
            PARAMETERS.replace('"acme-params", title', '"tf2", title'),
            "PARAMETERS",
            "the format name 'tf2' is already taken",
        ),
        (
            PARAMETERS.replace('"acme-params", title', '"list", title'),
            "PARAMETERS",
            "the format name 'list' is already taken",
        ),
        (
            PARAMETERS.replace('"acme-params", title', '"a/b", title'),
            "PARAMETERS",
            "the format name 'a/b' may contain only a-z, 0-9",
        ),
    ],
)
def test_a_broken_package_is_skipped_with_one_line_that_names_it(installed, file, caplog, module, value, words):
    installed(module=module, value=value)

    assert written_formats() == (*FORMATS, *CAMERA_ONLY)
    assert read_any(export(file, "tf2").data).format == "tf2"
    assert "the package acme-params 1.2: " in only_line(caplog)
    assert words in only_line(caplog)
    assert only_line(caplog).endswith(" uninstall it")


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ("return f", "failed (NameError: name 'unknown' is not defined)"),
        ("return 3 #", "failed (it returned int)"),
    ],
)
def test_a_writer_that_fails_gives_a_clear_error(installed, file, broken, words):
    installed(module=PARAMETERS.replace("return f", "return unknown + f" if "Name" in words else broken))

    with pytest.raises(InputError) as refusal:
        export(file, "acme-params")

    assert f"package acme-params 1.2 {words}" in str(refusal.value)


def test_a_reader_that_fails_gives_a_clear_error_and_a_recognizer_that_fails_recognizes_nothing(
    installed, file, caplog
):
    installed(module=PARAMETERS.replace("import numpy as np", ""))
    with pytest.raises(InputError, match=r"file: the format acme-params of the package acme-params 1\.2 failed \(Name"):
        read_any(export(file, "acme-params").data, "file")

    with pytest.raises(InputError, match="file: no pose of a camera and a radar in it"):
        read_any("/radar_camera: 3", "file")

    assert "recognizer failed (TypeError" in only_line(caplog)


def test_nothing_is_loaded_before_first_use_nor_for_our_own_formats(installed, file, caplog):
    installed(module="raise RuntimeError('loaded')")

    assert format_named("tf2").name == "tf2"
    assert read_any(export(file, "json").data).format == "json"
    assert caplog.records == []
    with pytest.raises(InputError, match="unknown format 'tf3'; did you mean tf2"):
        format_named("tf3")
    assert "RuntimeError: loaded" in only_line(caplog)


def test_a_package_in_the_current_folder_is_ignored(installed, tmp_path, monkeypatch):
    installed()
    monkeypatch.chdir(tmp_path / "site-packages")
    monkeypatch.syspath_prepend("")

    assert written_formats() == (*FORMATS, *CAMERA_ONLY)


def test_a_module_in_the_current_folder_does_not_take_the_place_of_the_package_s(
    installed, tmp_path, monkeypatch, caplog
):
    installed()
    (tmp_path / "acme_params.py").write_text("raise RuntimeError('taken from here')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend("")

    assert written_formats() == (*FORMATS, *CAMERA_ONLY)
    assert "acme_params is in the" in only_line(caplog)
    assert "taken from here" not in only_line(caplog)


@pytest.mark.slow
def test_a_broken_package_says_so_on_stderr_and_the_command_goes_on(installed, tmp_path):
    installed(module="raise RuntimeError('worn out')")
    program = f"import sys; sys.path.insert(0, {str(tmp_path / 'site-packages')!r}); from cocalib.cli import run; "
    command = [sys.executable, "-c", program + "sys.exit(run(['export', '--to', 'list']))"]

    done = subprocess.run(command, capture_output=True, text=True, check=False)

    assert (done.returncode, done.stdout.split()[0]) == (0, "json")
    (line,) = done.stderr.splitlines()
    words = ("cocalib: ", "acme-params 1.2", "acme_params:PARAMETERS", "(RuntimeError: worn out)")
    assert [part for part in words if part not in line] == []
