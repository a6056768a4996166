"""Messages that no registry knows are read by what they say about themselves: right, or with a stated assumption."""

import contextlib
import random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.errors import MessageError
from calib_core.measurements import TimeNs
from calib_core.recordings import describe
from calib_core.recordings.messages.definitions import parse_definition
from calib_core.recordings.plain_files.source import header_bytes
from calib_core.recordings.radar.layouts import recognise
from tests.unit.recordings.radar.test_registry import damaged
from tests.unit.recordings.radar.vendor_layouts import LAYOUTS, POLAR, RETURNS, SCANS, START_NS, Truth, fields, listed


def truths(scans: int = SCANS) -> list[Truth]:
    return [Truth.of(scan) for scan in range(scans)]


def joined(name: str) -> np.ndarray:
    return np.concatenate([getattr(truth, name) for truth in truths()])


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_vendors_layout_is_read_right_and_what_it_does_not_state_is_assumed(name: str) -> None:
    layout = LAYOUTS[name]
    with layout.recording() as recording:
        scans = recording.radar_scans()
        assumed = [one.key for one in recording.assumptions]
        text = describe(recording)
    assert sorted(assumed) == sorted(layout.assumed)
    np.testing.assert_array_equal(np.diff(scans.first_return), [RETURNS] * SCANS)
    points = np.concatenate([layout.positions(truth) for truth in truths()])
    np.testing.assert_allclose(scans.points_radar_m, points, atol=layout.tolerance_m)
    if layout.speed:
        np.testing.assert_allclose(scans.doppler_mps, joined("doppler"), atol=0.01)
    rounded = "int8" in layout.definition
    np.testing.assert_allclose(scans.snr_db, joined("amplitude"), atol=0.51 if rounded else 1e-4)
    for note in layout.notes:
        assert note in text
    for one in recording.assumptions:
        assert one.topic == "/radar"
        assert one.text in " ".join(text.split())


@pytest.mark.parametrize("name", [name for name, layout in LAYOUTS.items() if layout.assumed])
def test_confirmed_assumptions_are_no_longer_open_and_give_no_warning(name: str) -> None:
    with LAYOUTS[name].recording(confirm_assumptions=True) as recording:
        assert recording.assumptions == ()
        assert [one.confirmed for one in recording.stated_assumptions] == [True] * len(LAYOUTS[name].assumed)
        assert "assumed" not in [warning.code for warning in recording.warnings]


@pytest.mark.parametrize("name", LAYOUTS)
def test_damaged_messages_of_vendors_give_values_or_one_clear_error(name: str) -> None:
    layout = LAYOUTS[name]
    definition = parse_definition(layout.kind, layout.definition, "ros1")
    payloads = [header_bytes(TimeNs(START_NS), "radar") + layout.body(Truth.of(scan)) for scan in range(3)]
    reader = recognise(definition, payloads[0], lambda count: payloads)
    assert reader is not None
    rng = random.Random(name)
    for _ in range(40):
        worse = damaged(payloads[0], rng)
        with contextlib.suppress(MessageError):
            recognise(definition, worse, lambda count, worse=worse: [worse, *payloads])  # type: ignore[misc]
        with contextlib.suppress(MessageError):
            reader.returns(worse)


def test_a_second_azimuth_is_named_and_not_read() -> None:
    with listed(POLAR + "\nfloat32 azimuth_2 = half # rad").recording(scans=2) as recording:
        (other,) = [one.column for one in recording.radar_columns if one.quantity == "other azimuth"]
        points = recording.radar_scans().points_radar_m
    assert other == "azimuth_2"
    np.testing.assert_allclose(points, np.concatenate([truth.points for truth in truths(2)]), atol=1e-3)


PREFIXES = ["", "f_", "m_", "s_", "det_", "target_", "f", "radar_", "obj_", "fl"]


@settings(max_examples=25, deadline=None)
@given(st.sampled_from(PREFIXES), st.permutations(range(7)), st.booleans())
def test_prefixes_and_the_order_of_fields_do_not_change_what_is_read(prefix: str, order: Any, capital: bool) -> None:
    rows = fields(POLAR + "\nuint16 id = id\nfloat32 range_std = half")
    lines = []
    for place in order:
        kind, name, comment, quantity = rows[place]
        name = prefix + (name.title() if capital or prefix in ("f", "fl") else name)
        lines.append(f"{kind} {name} = {quantity}" + (f" # {comment}" if comment else ""))
    with listed("\n".join(lines)).recording(scans=3) as recording:
        scans = recording.radar_scans()
        assert recording.assumptions == ()
    expected = truths(3)
    np.testing.assert_allclose(scans.points_radar_m, np.concatenate([one.points for one in expected]), atol=1e-3)
    np.testing.assert_allclose(scans.doppler_mps, np.concatenate([one.doppler for one in expected]), atol=1e-3)
    np.testing.assert_allclose(scans.snr_db, np.concatenate([one.amplitude for one in expected]), atol=1e-3)
