"""Dwells end where the reflector's echo weakens."""

import numpy as np

from calib_core.association.dwells import FirmSpan, firm_span

TIMES_S = np.arange(0.0, 6.0, 0.1)


def test_weak_echoes_at_both_ends_are_left_out() -> None:
    snr_db = np.full(60, 30.0)
    snr_db[:3], snr_db[-4:] = 15.0, 17.0
    assert firm_span(TIMES_S, snr_db) == FirmSpan(3, 55)


def test_a_single_strong_scan_after_a_gap_is_no_end() -> None:
    snr_db = np.full(60, 30.0)
    snr_db[-8:-1] = np.nan
    assert firm_span(TIMES_S, snr_db) == FirmSpan(0, 51)


def test_an_echo_that_varies_keeps_its_ends() -> None:
    snr_db = 30.0 + 5.0 * np.random.default_rng(1).standard_normal(60)
    snr_db[[0, -1]] = 22.0
    assert firm_span(TIMES_S, snr_db) == FirmSpan(0, 59)


def test_nothing_is_left_out_without_strengths_or_where_an_echo_changes_for_long() -> None:
    assert firm_span(TIMES_S, np.full(60, np.nan)) == FirmSpan(0, 59)
    half = np.where(np.arange(60) < 25, 30.0, 12.0)
    assert firm_span(TIMES_S, half[::-1]).first == 0
    assert firm_span(TIMES_S[:2], np.array([30.0, 10.0])) == FirmSpan(0, 1)
