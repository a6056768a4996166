"""The deployment pack as a format: one zip archive, written from the other formats, read back through its manifest."""

import hashlib
from collections.abc import Mapping
from dataclasses import replace
from importlib.resources import files

from calib_core.errors import InputError
from calib_core.interchange.calibration_file import CalibrationFile
from calib_core.interchange.cameras.formats.ros import camera_info_text
from calib_core.interchange.format import Format, Reads
from calib_core.interchange.formats.pack.correction_files import correction_files
from calib_core.interchange.formats.pack.manifest import MANIFEST, manifest_text, verify
from calib_core.interchange.formats.pack.readme import readme_text
from calib_core.interchange.formats.pack.selftest_points import selftest_csv
from calib_core.interchange.formats.ros.launch_files import TF2_LAUNCH_PY
from calib_core.interchange.formats.ros.tf2_command import TF2
from calib_core.interchange.formats.ros.urdf import URDF
from calib_core.interchange.imported import ImportedCalibration
from calib_core.interchange.own.calibration_json import CALIBRATION_1, write_calibration
from calib_core.interchange.syntax.content import Content, readings
from calib_core.interchange.syntax.zip_archives import pack

_CALIBRATION = "calibration.json"
_README = "README.txt"
_TRANSFORMS = (TF2, TF2_LAUNCH_PY, URDF)
_LENSES_OF_THE_SELFTEST = ("pinhole", "plumb_bob", "rational_polynomial", "equidistant")
_DELIVERED = ("radar_correction.py", "radar_correction.hpp", "selftest.py", "selftest.cpp")
_NOTES = (
    "one zip archive, which --out FOLDER writes unpacked; its README.txt says what each file is; "
    "run python3 selftest.py on the robot",
)


def _write(file: CalibrationFile) -> bytes:
    """Write all files of the pack, zipped.

    Raises:
        InputError: the self-test does not know this lens, or a file cannot represent this calibration.
    """
    file = replace(file, made_from_sha256="")  # the pack holds the calibration that its files are made from
    calibration = file.calibration
    if calibration.camera.model not in _LENSES_OF_THE_SELFTEST:
        raise InputError(
            f"the pack's self-test cannot project through the lens model {calibration.camera.model} (it knows "
            f"{', '.join(_LENSES_OF_THE_SELFTEST)}); export json, which stores every lens"
        )
    members = {
        _CALIBRATION: write_calibration(file).encode(),
        "camera_info.yaml": camera_info_text(calibration.camera).encode(),
        **{f"tf/{form.file_name}": _text(form, file) for form in _TRANSFORMS},
        **correction_files(calibration),
        "selftest.csv": selftest_csv(calibration).encode(),
        **{name: _delivered(name) for name in _DELIVERED},
    }
    members = {_README: readme_text(file, (_README, *members, MANIFEST)).encode(), **members}
    return pack({**members, MANIFEST: manifest_text(members).encode()})


def _text(form: Format, file: CalibrationFile) -> bytes:
    content = form.write(file) if form.write is not None else ""
    return content.encode() if isinstance(content, str) else content


def _delivered(name: str) -> bytes:
    """Return code that is the same in every pack; line ends do not depend on the machine."""
    code = files("calib_core.interchange.formats.pack.delivered").joinpath(name).read_bytes()
    return code.replace(b"\r\n", b"\n")


def _recognizes(content: Content) -> bool:
    return _CALIBRATION in _files(content.members)


def _read(content: Content, source: str) -> ImportedCalibration:
    """Read the calibration in a pack whose files are those of its manifest.

    Raises:
        InputError: a file is missing, changed or not listed, or calibration.json is not calibration-1.
    """
    members = _files(content.members)
    verify(members, source=source)
    data = members[_CALIBRATION]
    own = next(readings(data, source=f"{source}: {_CALIBRATION}"))
    if CALIBRATION_1.reads is None or not CALIBRATION_1.reads.recognizes(own):
        raise InputError(f"{source}: {_CALIBRATION} is not cocalib/calibration-1; export the pack again")
    found = CALIBRATION_1.reads.read(own, f"{source}: {_CALIBRATION}")
    return replace(found, format=PACK.name, calibration_sha256=hashlib.sha256(data).hexdigest())


def _files(members: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the files of an archive by their path in the pack; it may have been zipped again with its folder."""
    found = {name: data for name, data in members.items() if not name.endswith("/")}
    folders = {name.partition("/")[0] for name in found}
    inside = f"{folders.pop()}/" if len(folders) == 1 and all("/" in name for name in found) else ""
    return {name.removeprefix(inside): data for name, data in found.items()}


PACK = Format(
    name="pack",
    title="Deployment pack: pose, camera_info, tf, angle map, self-test",
    used_in="cocalib",
    also="deploy zip robot self-test C++ Python",
    numbers="calibration.json: camera_from_radar and its inverse; tf/: pose of the child (camera, optical) in the parent (radar)",
    file_name="radar_camera_pack.zip",
    camera="lens",
    comment="keys",
    notes=_NOTES,
    write=_write,
    reads=Reads(_recognizes, _read),
    holds_angle_map=True,
    is_unpacked=True,
)
