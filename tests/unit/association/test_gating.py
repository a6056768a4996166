"""Static returns in range are kept, all others dropped, and the stamps stay the same."""

import numpy as np
import pytest

from calib_core.association.gating import static_returns
from calib_core.measurements import RadarScan, RadarScans, TimeNs
from calib_core.options import GatingOptions

NAN = float("nan")


def scan(time: int, rows: list[tuple[float, float, float, float]]) -> RadarScan:
    """Rows are x, y, z, Doppler."""
    table = np.array(rows).reshape(-1, 4)
    n = len(table)
    return RadarScan(TimeNs(time), table[:, :3], table[:, 3], np.arange(n, dtype=float), np.full((n, 3), np.nan))


def test_a_moving_return_is_dropped() -> None:
    scans = RadarScans.from_scans([scan(1, [(5, 0, 0, 0.0), (5, 1, 0, 0.2), (5, 2, 0, -0.2), (5, 3, 0, 0.05)])])
    kept = static_returns(scans, GatingOptions(max_speed_mps=0.05))
    assert kept.points_radar_m[:, 1].tolist() == [0.0, 3.0]
    assert kept.snr_db.tolist() == [0.0, 3.0]


def test_a_return_without_doppler_is_kept() -> None:
    kept = static_returns(RadarScans.from_scans([scan(1, [(5, 0, 0, NAN)])]), GatingOptions())
    assert len(kept.points_radar_m) == 1


@pytest.mark.parametrize("point", [(0.1, 0.0, 0.0), (80.0, 0.0, 0.0), (NAN, 0.0, 0.0), (5.0, 0.0, NAN)])
def test_a_return_out_of_range_or_without_position_is_dropped(point: tuple[float, float, float]) -> None:
    kept = static_returns(RadarScans.from_scans([scan(1, [(*point, 0.0), (5, 0, 0, 0.0)])]), GatingOptions())
    assert kept.points_radar_m.tolist() == [[5.0, 0.0, 0.0]]


def test_every_scan_is_kept_even_if_it_becomes_empty() -> None:
    scans = RadarScans.from_scans([scan(1, [(5, 0, 0, 1.0)]), scan(2, [(5, 0, 0, 0.0)]), scan(3, [])])
    kept = static_returns(scans, GatingOptions())
    assert kept.times_ns.tolist() == [1, 2, 3]
    assert [len(kept.scan(i)) for i in range(3)] == [0, 1, 0]
