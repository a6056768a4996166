"""A short slice of the fuzzing with a fixed seed, the committed corpus, and the fuzzer itself."""

import random
from pathlib import Path

import pytest

from calib_core.errors import RecordingError
from tests.fuzz.corpus import FOLDER, corpus_of
from tests.fuzz.fuzzing import Target, fuzz, offence
from tests.fuzz.mutation import mutated
from tests.fuzz.reached_lines import ReachedLines
from tests.fuzz.targets import TARGETS

ROUNDS = 100


@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_nothing_but_clear_errors_comes_of_a_changed_input(target, tmp_path):
    seeds = len(target.seeds(_new(tmp_path / "counted")))
    report = fuzz(
        target,
        (),
        _new(tmp_path / "run"),
        rng=random.Random(target.name),
        go_on=lambda report: report.tried < seeds + ROUNDS,
    )
    assert report.tried == seeds + ROUNDS
    assert [finding.what for finding in report.findings] == []


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_what_was_found_once_stays_mended(target, tmp_path):
    for data in corpus_of(target.name):
        assert offence(target, data, tmp_path) == ""


def test_every_folder_of_the_corpus_belongs_to_a_target():
    assert {path.name for path in FOLDER.iterdir()} <= {target.name for target in TARGETS}


def _careful(data: bytes, _folder: Path) -> None:
    """Fail only on one of 2 ** 24 beginnings, found step by step."""
    if data[:1] != b"R":
        raise RecordingError("not a radar")
    if data[1:2] != b"a":
        raise RecordingError("not a radar")
    if data[2:3] != b"d":
        raise RecordingError("not a radar")
    raise ZeroDivisionError("deep inside")


def test_a_fault_behind_three_checks_is_found_by_following_new_lines(tmp_path):
    target = Target("careful", _careful, lambda _: [b"...."], longest_bytes=4)
    guided = fuzz(
        target,
        (),
        tmp_path,
        rng=random.Random(1),
        go_on=lambda report: report.tried < 400_000 and not report.findings,
        lines=ReachedLines((__file__,)),
    )
    assert len(guided.findings) == 1
    assert "deep inside" in guided.findings[0].what
    assert guided.findings[0].data[:3] == b"Rad"


def test_the_same_seed_gives_the_same_inputs():
    seed, others = b"0123456789" * 20, (b"other input",)
    runs = [[mutated(seed, others, (b"word",), rng, 500) for _ in range(200)] for rng in map(random.Random, (5, 5, 6))]
    assert runs[0] == runs[1]
    assert runs[0] != runs[2]
    assert len(set(runs[0])) > 150


def test_an_error_without_words_and_any_other_exception_are_findings(tmp_path):
    def silent(_data: bytes, _folder: Path) -> None:
        raise RecordingError("")

    def crash(_data: bytes, _folder: Path) -> None:
        raise RecursionError

    assert offence(Target("silent", silent, lambda _: []), b"", tmp_path) == "an error without a message"
    assert "RecursionError" in offence(Target("crash", crash, lambda _: []), b"", tmp_path)


def _new(folder: Path) -> Path:
    folder.mkdir()
    return folder
