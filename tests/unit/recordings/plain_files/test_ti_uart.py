"""Streams of the data port of TI radars, made from known scans."""

import random
from itertools import pairwise

import cv2
import numpy as np
import pytest

from calib_core.errors import RecordingError
from calib_core.measurements import NS_PER_S
from calib_core.recordings import RecordingOptions, describe, inspect_recording, open_recording, verify_recording
from tests.unit.recordings.plain_files.ti_writing import (
    MAGIC,
    fixed_items,
    item,
    packet,
    scan_items,
    scans,
    stream,
)

START_S = 1_714_557_600
START = f"{START_S}.25"


def opened(path, start: str | None = START):
    return inspect_recording(path, RecordingOptions(radar_start=start))


def written(tmp_path, data: bytes, name: str = "xwr18xx_data.bin"):
    path = tmp_path / name
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("name", ["radar.bin", "radar.dat", "radar.raw", "radar"])
def test_a_stream_gives_the_scans_it_was_made_from(name, tmp_path):
    made = scans(40, np.random.default_rng(1))
    with opened(written(tmp_path, stream(made), name)) as recording:
        found = recording.radar_scans()
        assert len(found) == 40
        np.testing.assert_array_equal(np.diff(found.first_return), [len(points) for points, _ in made])
        points = np.concatenate([points for points, _ in made])
        np.testing.assert_allclose(found.points_radar_m, points[:, :3], atol=1e-6)
        np.testing.assert_allclose(found.doppler_mps, points[:, 3], atol=1e-6)
        np.testing.assert_allclose(found.snr_db, np.concatenate([snr for _, snr in made]), atol=1e-4)
        assert [warning.code for warning in recording.warnings] == ["assumed"]


def test_frames_are_as_far_apart_as_the_processor_counts_across_its_wrap_and_lost_frames(tmp_path):
    made = scans(900, np.random.default_rng(2))
    whole = [packet(n, scan_items(*one), len(one[0]), seconds=n * 0.05) for n, one in enumerate(made, 1)]
    kept = [n for n in range(900) if n % 7 != 3 and not 200 < n < 750]
    with opened(written(tmp_path, b"".join(whole[n] for n in kept))) as recording:
        expected = START_S * NS_PER_S + 250_000_000 + np.array(kept) * 50_000_000
        np.testing.assert_allclose(recording.radar_times - expected[0], expected - expected[0], atol=2_000_000)
        (assumption,) = recording.assumptions
        missing = kept[-1] + 1 - kept[0] - len(kept)
        assert f"{missing} frames are missing" in recording.warnings[0].facts["message"]
    assert assumption.key == "time-unit"
    assert "0.05 s per frame" in assumption.text
    assert assumption.confirm == "--radar-start TIME,SECONDS_PER_FRAME"


def test_the_user_states_start_and_period(tmp_path):
    path = written(tmp_path, stream(scans(5, np.random.default_rng(3)), first=100))
    with opened(path, f"{START},0.1") as recording:
        assert recording.assumptions == ()
        assert recording.warnings == ()
        np.testing.assert_array_equal(np.diff(recording.radar_times), 10**8)
        assert recording.radar_times[0] == START_S * NS_PER_S + 250_000_000
    with opened(path, None) as recording:
        assert [one.key for one in recording.assumptions] == ["time-start", "time-unit"]
    for wrong in ("soon", f"{START},often", f"{START},-1"):
        with pytest.raises(RecordingError, match="--radar-start"):
            opened(path, wrong)


def test_times_beside_the_stream_are_used(tmp_path):
    path = written(tmp_path, stream(scans(3, np.random.default_rng(4))))
    times = [START_S * NS_PER_S + number * 61_000_000 for number in range(3)]
    table = path.with_suffix(".csv")
    table.write_text("frame,time_ns\n" + "".join(f"{number},{time}\n" for number, time in enumerate(times)))
    with opened(path, None) as recording:
        assert recording.radar_times.tolist() == times
        assert recording.assumptions == ()
    table.write_text("time_ns\n1714557600000000000\n")
    with pytest.raises(
        RecordingError, match=r"1 times for the 3 packets of xwr18xx_data\.bin; give one line per packet"
    ):
        opened(path, None)


@pytest.mark.parametrize(("version", "subframe"), [(0x01020000, False), (0x02010004, True)])
def test_the_fixed_point_of_older_kits_is_read(version, subframe, tmp_path):
    made = scans(6, np.random.default_rng(5))
    data = b"".join(
        packet(n, fixed_items(points, np.full(len(points), 700)), len(points), seconds=n * 0.1, version=version,
               subframe=subframe, platform=0xA1642)
        for n, (points, _) in enumerate(made, 1)
    )  # fmt: skip
    with opened(written(tmp_path, data)) as recording:
        found = recording.radar_scans()
        points = np.concatenate([points for points, _ in made])[:, :3]
        np.testing.assert_allclose(found.points_radar_m, points, atol=1 / 2**9)
        text = describe(recording)
    assert "xWR1642, SDK " in text
    assert "without range profile" in text


def test_a_demo_that_counts_the_heads_of_its_items_is_read(tmp_path):
    points = np.array([[3.0, 0.5, 0.25, -1.0]])
    value = np.array([[-0.5, 3.0, 0.25, -1.0]], dtype="<f4").tobytes()
    data = b"".join(packet(n, [item(1, value, inclusive=True)], 1, seconds=n * 0.1) for n in range(1, 5))
    with opened(written(tmp_path, data)) as recording:
        np.testing.assert_allclose(recording.radar_scans().points_radar_m, np.repeat(points[:, :3], 4, axis=0))


def test_a_stream_in_chunks_is_one_radar_whatever_cuts_them(tmp_path):
    made = scans(30, np.random.default_rng(6))
    data = stream(made)
    folder = tmp_path / "chunks"
    folder.mkdir()
    places = [0, *sorted(random.Random(1).sample(range(len(data)), 11)), len(data)]
    for number, (begin, end) in enumerate(pairwise(places)):
        (folder / f"radar_{number}.dat").write_bytes(data[begin:end])
    with opened(folder) as recording:
        assert len(recording.radar_scans()) == 30
        assert "12 files" in describe(recording)
        found = verify_recording(recording)
    assert found.sound
    assert found.files[0].size_bytes == len(data)


def test_a_scan_without_points_counts_as_empty(tmp_path):
    data = packet(1, [item(6, bytes(24))], 0, seconds=0.1) + stream(scans(2, np.random.default_rng(7)), first=2)
    with opened(written(tmp_path, data)) as recording:
        assert np.diff(recording.radar_scans().first_return)[0] == 0


@pytest.mark.slow
def test_damage_costs_only_the_packets_it_hits_and_is_told(tmp_path):
    made = scans(30, np.random.default_rng(8))
    data = stream(made)
    rng = random.Random(9)
    for number in range(60):
        broken = bytearray(data)
        kind, place = number % 4, rng.randrange(len(data))
        if kind == 0:
            broken[place] ^= 1 << rng.randrange(8)
        elif kind == 1:
            del broken[place : place + rng.randrange(1, 400)]
        elif kind == 2:
            broken[place:place] = rng.randbytes(rng.randrange(1, 400))
        else:
            del broken[place:]
        path = written(tmp_path, bytes(broken))
        try:
            with opened(path) as recording:
                found = verify_recording(recording)
                count = len(recording.radar_times)
                told = {warning.code for warning in recording.warnings}
        except RecordingError as error:
            assert kind == 3
            assert len(str(error)) > 40  # noqa: PT017
            continue
        whole = sum(data[begin:end] in broken for begin, end in packets(data))
        assert count >= whole
        if whole < 30 and kind in (1, 2) and place < len(data) - 500:
            assert "damaged-file" in told
            assert not found.sound


def packets(data: bytes) -> list[tuple[int, int]]:
    places = [place for place in range(len(data)) if data.startswith(MAGIC, place)]
    return list(pairwise([*places, len(data)]))


def test_a_restart_of_the_sensor_is_told(tmp_path):
    made = scans(6, np.random.default_rng(10))
    with opened(written(tmp_path, stream(made) + stream(made))) as recording:
        assert len(recording.radar_times) == 12
        assert "sensor-restarted" in {warning.code for warning in recording.warnings}


def test_other_files_of_such_a_radar_are_refused_by_their_true_name(tmp_path):
    samples = np.random.default_rng(11).normal(0, 200, 30_000).astype("<i2").tobytes()
    for name in ("adc_data.bin", "drive_Raw_0.bin"):
        with pytest.raises(RecordingError, match="raw ADC samples of a DCA1000 capture card"):
            opened(written(tmp_path, samples, name), None)
    commands = b"sensorStop\r\nDone\r\nmmwDemo:/>profileCfg 0 77 7 7 57.14\r\n"
    with pytest.raises(RecordingError, match="configuration port: it holds commands, no detections"):
        opened(written(tmp_path, commands, "cfg.log"), None)


def test_files_of_other_kinds_open_as_before(tmp_path, jpeg):
    folder = tmp_path / "delft"
    folder.mkdir()
    rows = np.random.default_rng(12).normal(size=(20, 7)).astype("<f4")
    rows[:, 0], rows[:, 6] = abs(rows[:, 0]), 0
    for number in range(3):
        (folder / f"{START_S}{number:09d}.bin").write_bytes(rows.tobytes())
    with opened(folder, None) as recording:
        assert len(recording.radar_scans()) == 3
    with pytest.raises(RecordingError, match="no TI data-port stream among delft; remove the option"):
        opened(folder, START)


def test_a_stream_is_opened_with_the_images_of_its_camera(tmp_path):
    path = written(tmp_path, stream(scans(20, np.random.default_rng(13))))
    folder = tmp_path / "front"
    folder.mkdir()
    for number in range(10):
        name = folder / f"{START_S * NS_PER_S + 250_000_000 + number * 10**8}.png"
        cv2.imwrite(str(name), np.zeros((20, 30, 3), dtype=np.uint8))
    with open_recording([folder, path], RecordingOptions(radar_start=f"{START},0.05")) as recording:
        assert (len(recording.image_times), len(recording.radar_times)) == (10, 20)
        assert recording.image_times[0] == recording.radar_times[0]


@pytest.mark.parametrize("inner", ["", "radar/raw"])
def test_a_folder_with_a_stream_and_images_below_is_read_whole(tmp_path, jpeg, inner):
    (tmp_path / inner).mkdir(parents=True, exist_ok=True)
    written(tmp_path / inner, stream(scans(20, np.random.default_rng(14))))
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "plan.csv").write_text("who,what\nme,this\n")
    (tmp_path / "front").mkdir()
    for number in range(10):
        (tmp_path / "front" / f"{START_S * NS_PER_S + 250_000_000 + number * 10**8}.jpg").write_bytes(jpeg)
    with open_recording(tmp_path, RecordingOptions(radar_start=f"{START},0.05")) as recording:
        assert (len(recording.image_times), len(recording.radar_times)) == (10, 20)
        assert "plan.csv" in describe(recording)


def test_a_folder_with_only_a_stream_names_what_it_does_not_use(tmp_path):
    written(tmp_path, stream(scans(20, np.random.default_rng(15))))
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "plan.csv").write_text("who,what\nme,this\n")
    with opened(tmp_path) as recording:
        assert len(recording.radar_times) == 20
        assert "plan.csv" in describe(recording)
