"""Where everything comes from: files by their hashes, topics and clocks, options, what is assumed, versions."""

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import Any

from calib_core.camera import Camera
from calib_core.interchange.calibration_file import VehicleNote
from calib_core.options import CalibrationOptions
from calib_core.results import InputFile
from cocalib.report.markup import Markup, scrolled, tag
from cocalib.report.subject import ReportSubject
from cocalib.view.wording import sentence

_MOST_FILES, _MOST_ROWS = 12, 19
_RESTS_ON = {
    "clicked": "clicks: solved from pairs of radar positions and clicked pixels",
    "imported_proven": "an import whose meaning a check point, pairs or another calibration proved",
    "imported_assumed": "an import whose meaning is assumed",
    "automatic": "automatic, unconfirmed clicks",
    "carried": "an older calibration, carried forward by a turn that was watched",
}


def provenance(subject: ReportSubject) -> Markup:
    """Return the tables of files and facts."""
    files = _files(subject)
    hidden = f"{len(files) - _MOST_FILES} more files." if len(files) > _MOST_FILES else None
    facts = list(_facts(subject))
    return tag(
        "section",
        tag("h2", "Provenance"),
        scrolled(
            "Files",
            tag("thead", tag("tr", *(tag("th", head, scope="col") for head in ("file", "what", "bytes", "SHA-256")))),
            tag("tbody", *(_file_row(what, one) for what, one in files[:_MOST_FILES])),
            class_="files",
        ),
        tag("p", hidden, class_="note") if hidden else None,
        tag("dl", *(part for name, value in facts[:_MOST_ROWS] for part in (tag("dt", name), tag("dd", value)))),
        id="provenance",
    )


def _file_row(what: str, file: InputFile) -> Markup:
    size = f"{file.size_bytes:,}".replace(",", " ")
    return tag(
        "tr", tag("th", file.name, scope="row"), tag("td", what), tag("td", size), tag("td", tag("code", file.sha256))
    )


def _files(subject: ReportSubject) -> list[tuple[str, InputFile]]:
    """Return every file once, with what it is to this report."""
    made_from = subject.found.file.provenance.inputs if subject.found.file is not None else ()
    parts = (
        ("this calibration", subject.inputs),
        ("it was made from", made_from),
        (
            "judged on" if subject.judged is not None else "recording",
            subject.recording.inputs if subject.recording is not None else (),
        ),
    )
    roles: dict[InputFile, list[str]] = {}
    for role, files in parts:
        for file in files:
            roles.setdefault(file, []).append(role)
    return [(", ".join(dict.fromkeys(names)), one) for one, names in roles.items()]


def _facts(subject: ReportSubject) -> Iterator[tuple[str, str]]:
    """Yield what else is known, as (name, text)."""
    file = subject.found.file
    yield "format", "cocalib/calibration-1" if file is not None else subject.found.format
    evidence = file.rests_on if file is not None else subject.found.evidence or "imported_assumed"
    said = ", as the file states" if file is None and subject.found.evidence is not None else ""
    yield "evidence", f"{_RESTS_ON[evidence]}{said}"
    yield "report by", f"cocalib {subject.version}"
    if file is not None:
        made = file.provenance
        yield from _known_rows(
            ("vehicle", _vehicle(file.vehicle)),
            ("session", file.vehicle.session),
            ("serials", _serials(file.vehicle)),
            ("solved by", f"cocalib {made.version}" if made.version else None),
            ("radar", made.radar_choice or _topic(made.radar_topic, made.radar_clock)),
            ("images", _topic(made.image_topic, made.image_clock)),
            ("intrinsics", made.camera_info_topic),
            ("radar axes", made.radar_axes),
            ("video start", made.video_start),
            ("columns", ", ".join(made.column_map)),
            ("damaged", "; ".join(made.damage)),
            ("options", _options(file.calibration.options)),
            ("made from", made_from if (made_from := file.made_from_sha256) else None),
        )
        yield from (
            ("assumed" if not assumption.confirmed else "confirmed", sentence(assumption.text))
            for assumption in made.assumptions
        )
    if subject.calibration is not None:
        yield "lens", _lens(subject.calibration.camera)
        if subject.calibration.given_camera is not None:
            yield "lens before it was refined", _lens(subject.calibration.given_camera)
    if subject.recording is not None:
        yield from ((f"recording, {what}", topic) for what, topic in subject.recording.topics)


def _vehicle(note: VehicleNote) -> str | None:
    return f"{note.name or 'unnamed'}, of type {note.type}" if note.type else note.name


def _serials(note: VehicleNote) -> str | None:
    stated = (("radar", note.radar_serial), ("camera", note.camera_serial))
    return ", ".join(f"{what} {serial}" for what, serial in stated if serial) or None


def _known_rows(*rows: tuple[str, str | None]) -> Iterator[tuple[str, str]]:
    yield from ((name, value) for name, value in rows if value)


def _topic(name: str | None, clock: str | None) -> str | None:
    return f"{name}, by {clock} stamps" if name and clock else name


def _lens(camera: Camera) -> str:
    k = camera.matrix_px
    coefficients = ", ".join(f"{value:.6g}" for value in camera.distortion.tolist())
    distortion = f", distortion {coefficients}" if coefficients else ""
    return (
        f"{camera.model}, {camera.width_px} x {camera.height_px} px, fx {k[0, 0]:.6g}, fy {k[1, 1]:.6g}, "
        f"cx {k[0, 2]:.6g}, cy {k[1, 2]:.6g}{distortion}"
    )


def _options(options: CalibrationOptions) -> str:
    """Return the method, and every option that is not at its default."""
    changed = [f"{name} = {value}" for name, value in _changed_options(options, type(options)()) if name != "method"]
    return f"method {options.method}; " + ("; ".join(changed) if changed else "all others at their defaults")


def _changed_options(given: Any, usual: Any, before: str = "") -> Iterator[tuple[str, str]]:
    for field in fields(given):
        value, default = getattr(given, field.name), getattr(usual, field.name)
        if is_dataclass(value) and type(value) is type(default):
            yield from _changed_options(value, default, f"{before}{field.name}.")
        elif value != default:
            yield f"{before}{field.name}", f"{value:.6g}" if isinstance(value, float) else str(value)
