"""The report of a check as JSON with documented keys, and as JUnit XML for continuous integration."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import msgspec
import numpy as np

from calib_core.input_files import encodable
from calib_core.interchange.check.report import CheckReport
from calib_core.interchange.check.slips import CheckResult
from calib_core.interchange.syntax.strict_json import json_text

CHECK_SCHEMA = "cocalib/check-1"
_CODES = {"right": 0, "unproven": 0, "doubtful": 3, "wrong": 1}


@dataclass(frozen=True, slots=True, eq=False)
class CheckedFile:
    """One file of a check.

    Attributes:
        name: of the file.
        report: None if it cannot be read.
        unreadable: why not; "" if it can.
    """

    name: str
    report: CheckReport | None = None
    unreadable: str = ""

    @property
    def verdict(self) -> str:
        """The report's verdict, or "unreadable"."""
        return self.report.verdict if self.report else "unreadable"

    @property
    def line(self) -> str:
        """The verdict and what decided it, for lists of many files."""
        if self.report is None:
            return self.unreadable
        results = self.report.results
        first = next((one for level in ("error", "good", "warning") for one in results if one.level == level), None)
        return f"{self.name}: {self.verdict}" + (f": {first.message}" if first else "")


def exit_code(files: Sequence[CheckedFile]) -> int:
    """Return the exit code of a check: 1 if a file is wrong, else 2 if one cannot be read, else 3 if one is doubtful, else 0."""
    codes = {_CODES.get(file.verdict, 2) for file in files}
    return next((code for code in (1, 2, 3) if code in codes), 0)


def check_json(files: Sequence[CheckedFile]) -> str:
    """Return the reports as one JSON object; docs/formats.md lists its keys."""
    verdicts = [_document(file) for file in files]
    return json_text(encodable({"schema": CHECK_SCHEMA, "exit_code": exit_code(files), "files": verdicts}))


def _document(file: CheckedFile) -> dict[str, Any]:
    report = file.report
    document: dict[str, Any] = {"file": file.name, "verdict": file.verdict, "error": file.unreadable or None}
    if report is None:
        unknown = dict.fromkeys(("format", "evidence", "calibration_sha256", "frames", "comparison"))
        return document | unknown | {"assumptions": [], "notes": [], "results": []}
    found = report.imported
    return document | {
        "format": found.format,
        "evidence": found.evidence,
        "calibration_sha256": found.calibration_sha256,
        "frames": msgspec.to_builtins(found.frames),
        "assumptions": list(found.assumptions),
        "notes": list(found.notes),
        "results": msgspec.to_builtins(report.results),
        "comparison": _comparison(report),
    }


def _comparison(report: CheckReport) -> dict[str, Any] | None:
    both, judgement = report.comparison, report.judgement
    if both is None or judgement is None:
        return None
    lens = None if both.lens is None else {"rms_px": _number(both.lens.rms_px), "differs": both.lens.text}
    return {
        "agree": judgement.agree,
        "significant": judgement.significant,
        "basis": judgement.basis,
        "criteria": [
            {"name": one.name, "value": _number(one.value), "limit": one.limit, "met": one.met}
            for one in judgement.criteria
        ],
        "rotation_deg": both.rotation_deg,
        "rotation_sigma_deg": _number(both.rotation_sigma_deg),
        "position_cm": both.position_cm,
        "position_sigma_cm": _number(both.position_sigma_cm),
        "pixels": [
            {
                "distance_m": at.distance_m,
                "rms_px": _number(at.rms_px),
                "max_px": _number(at.max_px),
                "sigma_px": _number(at.sigma_px),
                "pose_rms_px": _number(at.pose_rms_px),
                "lost_share": at.lost_share,
            }
            for at in both.pixels
        ],
        "lens": lens,
        "chi2": _number(both.chi2),
        "chi2_limit": both.chi2_limit,
        "p_value": _number(both.p_value),
        "sigmas": _number(both.sigmas),
        "covariances": both.covariances,
    }


def _number(value: float) -> float | None:
    """Return a number that JSON has: None for infinite and unknown ones."""
    return float(value) if np.isfinite(value) else None


def check_junit(files: Sequence[CheckedFile]) -> str:
    """Return the reports as JUnit XML: a test suite per file, a test case per result."""
    root = ElementTree.Element("testsuites", name="cocalib check")
    for file in files:
        _add_suite(root, file)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _add_suite(root: ElementTree.Element, file: CheckedFile) -> None:
    suite = ElementTree.SubElement(root, "testsuite", name=_xml(file.name))
    if file.report is None:
        case = _case(suite, file, "readable")
        ElementTree.SubElement(case, "error", message=_xml(file.unreadable), type="unreadable")
    else:
        for result in file.report.results:
            _add_result(suite, file, result)
        _add_verdict(suite, file)
    for key, tag in (("tests", "testcase"), ("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(key, str(len(list(suite.iter(tag)))))


def _case(suite: ElementTree.Element, file: CheckedFile, name: str) -> ElementTree.Element:
    return ElementTree.SubElement(suite, "testcase", classname=_xml(file.name), name=name, time="0")


def _add_result(suite: ElementTree.Element, file: CheckedFile, result: CheckResult) -> None:
    case = _case(suite, file, result.code)
    text = _xml(f"{result.message}; {result.hint}" if result.hint else result.message)
    if result.level == "error":
        ElementTree.SubElement(case, "failure", message=text, type=result.code)
    else:
        ElementTree.SubElement(case, "system-out").text = text


def _add_verdict(suite: ElementTree.Element, file: CheckedFile) -> None:
    """Add a case for the proof as a whole: a doubtful file fails, an unproven one is skipped."""
    assert file.report is not None
    case, text = _case(suite, file, "verdict"), _xml(file.report.lines()[-1])
    if file.verdict == "doubtful":
        ElementTree.SubElement(case, "failure", message=text, type="doubtful")
    elif file.verdict == "unproven":
        ElementTree.SubElement(case, "skipped", message=text)


def _xml(text: str) -> str:
    """Replace what XML cannot contain: control characters, and halves of surrogate pairs."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
