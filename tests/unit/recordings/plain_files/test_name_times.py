"""Times in file names: dates in every spelling, and what the digits after the second mean."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, open_recording
from calib_core.recordings.plain_files.file_stamps import times_in_names
from calib_core.recordings.time.written_times import DATE_SPELLINGS, moments_in, read_time

MOMENT = datetime(2024, 5, 17, 9, 42, 31, 208764, UTC)
MOMENT_NS = 1_715_938_951_208_764_000

PATTERNS = {
    "%Y-%m-%dT%H:%M:%S.{us}Z": True, "%Y-%m-%dT%H:%M:%S.{us}": True, "%Y-%m-%d %H:%M:%S.{us}": True,
    "%Y/%m/%d/%H:%M:%S.{us}": True, "%Y/%m/%d %H:%M:%S.{us}": True, "%d.%m.%Y %H:%M:%S.{us}": True,
    "%Y-%m-%d_%H-%M-%S-{us}": True, "%Y-%m-%d-%H-%M-%S_{us}": True, "%Y_%m_%d_%H_%M_%S_{us}": True,
    "%Y%m%d_%H%M%S_{us}": True, "%Y%m%dT%H%M%S.{us}Z": True, "%Y%m%d-%H%M%S-{us}": True, "%Y%m%d%H%M%S{us}": True,
    "%Y-%m-%dT%H.%M.%S.{us}Z": True, "%Y-%m-%d_%Hh%Mm%Ss{us}": True,
    "img_%Y-%m-%d_%H-%M-%S-{us}": False, "%Y%m%d_%H%M%S_{us}_left": False, "cam2_%Y%m%dT%H%M%S{us}": False,
    "frame_000123_%Y-%m-%d-%H-%M-%S-{us}": False,
}  # fmt: skip
"""strftime patterns, and whether the date is all there is."""


def written(moment: datetime, pattern: str) -> str:
    return moment.strftime(pattern.replace("{us}", f"{moment.microsecond:06d}"))


def epoch_ns(moment: datetime) -> int:
    return (moment - datetime(1970, 1, 1, tzinfo=UTC)) // timedelta(microseconds=1) * 1000


@pytest.mark.parametrize("text", DATE_SPELLINGS)
def test_the_spellings_in_the_documentation_are_one_moment(text):
    assert read_time(text) == MOMENT_NS


@given(
    moment=st.datetimes(datetime(1971, 1, 1), datetime(2099, 12, 31), timezones=st.just(UTC)),
    pattern=st.sampled_from(sorted(PATTERNS)),
)
def test_any_date_in_any_pattern_reads_back_to_the_microsecond(moment, pattern):
    text = written(moment, pattern)
    times = [one.time for one in moments_in(text)]
    assert times == [epoch_ns(moment)]
    if PATTERNS[pattern]:
        assert read_time(text) == epoch_ns(moment)


@given(
    start=st.datetimes(datetime(2002, 1, 1), datetime(2090, 12, 31), timezones=st.just(UTC)),
    pattern=st.sampled_from(sorted(PATTERNS)),
    step_us=st.integers(10_000, 3_000_000),
)
def test_the_names_of_a_camera_keep_its_order_and_its_stamps(start, pattern, step_us):
    moments = [start + timedelta(microseconds=step_us * number) for number in range(12)]
    found = times_in_names([written(moment, pattern) for moment in moments])
    assert found.times_ns.tolist() == [epoch_ns(moment) for moment in moments]
    assert (found.assumed, found.disorder) == ("", 0)


def names_of(moments: list[datetime], text) -> list[str]:
    return [text(number, moment) for number, moment in enumerate(moments)]


TEN_HZ = [MOMENT + timedelta(milliseconds=100 * number) for number in range(40)]


@pytest.mark.parametrize(
    ("text", "tolerance_s", "assumed"),
    [
        (lambda n, m: f"img_{m:%Y-%m-%d_%H-%M-%S}-{m.microsecond:06d}", 0, ""),
        (lambda n, m: f"{m:%Y%m%d_%H%M%S}_{m.microsecond // 1000:03d}", 0.001, ""),
        (lambda n, m: f"{m:%Y-%m-%dT%H.%M.%S}.{m.microsecond // 1000:03d}Z", 0.001, ""),
        (lambda n, m: f"frame_{n:06d}_{m.timestamp():.6f}", 0, ""),
        (lambda n, m: f"{int(m.timestamp())}_{m.microsecond:06d}_{n:04d}", 0, ""),
        (lambda n, m: f"{m:%Y%m%d_%H%M%S}_{m.microsecond}", 0, "microseconds"),
        (lambda n, m: f"{m:%Y%m%d_%H%M%S}_{m.microsecond // 10000:02d}", 0.01, "decimal fraction"),
        (lambda n, m: f"{m:%Y%m%d_%H%M%S}_{n:06d}", 0.06, "spread evenly"),
        (lambda n, m: f"{int(m.timestamp())}_{n:03d}", 0.06, "spread evenly"),
        (lambda n, m: f"{m:%Y%m%d_%H%M%S}_{m.microsecond // 100_000}", 0.06, "spread evenly"),
        (lambda n, m: f"log_2024-05-17-08-00-00_{m:%Y-%m-%d-%H-%M-%S}-{m.microsecond:06d}", 0, ""),
        (lambda n, m: f"n015-2018-07-24-11-22-45+0800__CAM__{epoch_ns(m) // 1000}", 0, ""),
    ],
)  # fmt: skip
def test_names_are_read_right_or_under_a_stated_assumption(text, tolerance_s, assumed):
    found = times_in_names(names_of(TEN_HZ, text))
    expected = np.array([epoch_ns(moment) for moment in TEN_HZ])
    assert np.abs(found.times_ns - expected).max() <= tolerance_s * NS_PER_S
    assert (np.diff(found.times_ns) > 0).all()
    assert assumed in found.assumed
    assert bool(assumed) == bool(found.assumed)


@pytest.mark.parametrize(
    "names",
    [
        ["2024-05-17_000001", "2024-05-17_000002"],
        ["2024-05-17-09-42-31_000001", "2024-05-17-09-42-31_000002", "2024-05-17-09-42-31_000003"],
        ["00001", "00002"],
        ["frame12", "frame13"],
    ],
)
def test_names_without_times_of_their_own_have_none(names):
    assert times_in_names(names) is None


def folder_of(folder: Path, names: list[str]) -> Path:
    folder.mkdir(parents=True)
    for name in names:
        assert cv2.imwrite(str(folder / name), np.zeros((8, 8, 3), np.uint8))
    return folder


def test_images_whose_digits_are_open_are_an_assumption(tmp_path):
    names = names_of(TEN_HZ, lambda n, m: f"{m:%Y%m%d_%H%M%S}_{n:06d}.png")
    folder = folder_of(tmp_path / "camera", names)
    with open_recording(folder, require=("image",)) as recording:
        (assumption,) = recording.assumptions
        assert [warning.code for warning in recording.warnings] == ["assumed"]
    assert (assumption.key, assumption.topic) == ("name-times", "/camera/image")
    assert "spread evenly" in assumption.text


def test_numbers_that_contradict_the_times_are_told(tmp_path):
    names = names_of(TEN_HZ, lambda n, m: f"{(n * 7) % 40:04d}_{m:%Y%m%d_%H%M%S}_{m.microsecond:06d}.png")
    with open_recording(folder_of(tmp_path / "camera", names), require=("image",)) as recording:
        (warning,) = recording.warnings
    assert warning.code == "file-order"
    assert "disagree about the order" in warning.facts["message"]


def test_local_times_are_moved_by_the_given_zone(tmp_path):
    names = names_of(TEN_HZ, lambda n, m: f"{m:%Y%m%d_%H%M%S}_{m.microsecond:06d}.png")
    folder = folder_of(tmp_path / "camera", names)
    with open_recording(folder, RecordingOptions(time_zone="+02:00"), require=("image",)) as recording:
        assert recording.image_times[0] == MOMENT_NS - 7200 * NS_PER_S


def test_a_folder_without_any_readable_image_is_refused(tmp_path):
    folder = tmp_path / "camera"
    folder.mkdir()
    (folder / "1715938951208.jpg").write_bytes(b"")
    (folder / "1715938951308.jpg").write_text("<html>not found</html>")
    with pytest.raises(RecordingError, match=r"none of its 2 images can be read: 1715938951208\.jpg has no bytes"):
        open_recording(folder, require=("image",))


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda data: b"", "has no bytes"),
        (lambda data: data[: len(data) // 2], "is cut off"),
        (lambda data: b"<html>" + data, "is not an image (it begins with 3c68746d)"),
    ],
)
def test_images_that_cannot_be_read_are_counted_and_named(tmp_path, damage, words):
    folder = folder_of(tmp_path / "camera", [f"{MOMENT_NS + n}.png" for n in range(5)])
    for number in (1, 3):
        path = folder / f"{MOMENT_NS + number}.png"
        path.write_bytes(damage(path.read_bytes()))
    with open_recording(folder, require=("image",)) as recording:
        assert len(recording.image_times) == 3
        (warning,) = recording.warnings
    assert warning.code == "unreadable-pictures"
    assert warning.facts["message"].startswith("2 of 5 images ")
    assert words in warning.facts["message"]
