"""Every click gets radar positions, or a reason why it has none."""

import numpy as np

from calib_core.association.pairing import pair_clicks
from calib_core.measurements import NS_PER_S, RadarScan, RadarScans, ReflectorClick, TimeNs
from calib_core.options import CalibrationOptions


def scans_at(times_s: list[float], *, doppler_mps: float = 0.0) -> RadarScans:
    return RadarScans.from_scans(
        [
            RadarScan(
                TimeNs(round(time * NS_PER_S)),
                np.array([[6.0, 0.5, -1.0]]),
                np.array([doppler_mps]),
                np.array([30.0]),
                np.full((1, 3), np.nan),
            )
            for time in times_s
        ]
    )


def click(name: str, time_s: float) -> ReflectorClick:
    return ReflectorClick(TimeNs(round(time_s * NS_PER_S)), name, 100.0, 50.0)


def test_pairs_come_in_order_of_image_time_whatever_the_order_of_clicks() -> None:
    scans = scans_at([0.1 * k for k in range(100)])
    clicks = [click("b", 5.0), click("a", 2.0), click("c", 8.0)]
    forward, backward = (pair_clicks(order, scans, CalibrationOptions()) for order in (clicks, clicks[::-1]))
    assert [pair.id for pair in forward.pairs] == ["a", "b", "c"] == [pair.id for pair in backward.pairs]
    assert forward.pairs[0].candidates[0].position_radar_m.tobytes() == (
        backward.pairs[0].candidates[0].position_radar_m.tobytes()
    )


def test_a_click_far_from_every_scan_stays_unpaired_with_the_gap() -> None:
    pairing = pair_clicks([click("a", 12.0)], scans_at([0.0, 1.0]), CalibrationOptions())
    assert pairing.pairs == ()
    assert pairing.unpaired[0].code == "no-scan"
    assert "11.00 s" in pairing.unpaired[0].reason


def test_a_click_among_moving_returns_stays_unpaired() -> None:
    pairing = pair_clicks([click("a", 0.5)], scans_at([0.0, 0.5, 1.0], doppler_mps=1.0), CalibrationOptions())
    assert [one.code for one in pairing.unpaired] == ["no-static-return"]


def test_a_recording_without_scans_leaves_every_click_unpaired() -> None:
    pairing = pair_clicks([click("b", 1.0), click("a", 0.5)], RadarScans(), CalibrationOptions())
    assert [(one.id, one.code) for one in pairing.unpaired] == [("a", "no-scan"), ("b", "no-scan")]


def test_a_pair_carries_the_stamp_of_the_nearest_scan() -> None:
    (pair,) = pair_clicks([click("a", 0.52)], scans_at([0.0, 0.5, 1.0]), CalibrationOptions()).pairs
    assert pair.radar_time == round(0.5 * NS_PER_S)
    assert pair.candidates[0].scans == 3
