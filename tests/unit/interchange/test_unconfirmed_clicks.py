"""What a clicks-1 file says of clicks that nobody confirmed."""

import pytest

from calib_core.errors import InputError
from calib_core.interchange.own.clicks_json import read_clicks, read_clicks_file, write_clicks
from calib_core.measurements import ReflectorClick, TimeNs
from calib_core.results import UnconfirmedClicks

CLICKS = tuple(ReflectorClick(TimeNs(time), name, 3.0, 4.0) for time, name in ((1, "a"), (2, "b"), (3, "c")))


def test_it_is_read_back() -> None:
    unconfirmed = UnconfirmedClicks(("a", "c"), 0.875)
    file = read_clicks_file(write_clicks(CLICKS, unconfirmed=unconfirmed))
    assert (file.clicks, file.unconfirmed) == (CLICKS, unconfirmed)


def test_a_file_whose_clicks_a_person_placed_says_nothing() -> None:
    text = write_clicks(CLICKS)
    assert "unconfirmed" not in text
    assert read_clicks_file(text).unconfirmed is None


def test_clicks_that_were_taken_out_of_the_file_no_longer_count() -> None:
    text = write_clicks(CLICKS[1:], unconfirmed=UnconfirmedClicks(("a", "c"), 0.875))
    assert read_clicks_file(text).unconfirmed == UnconfirmedClicks(("c",), 0.875)
    assert read_clicks_file(write_clicks(CLICKS[1:2], unconfirmed=UnconfirmedClicks(("a",), 0.9))).unconfirmed is None


@pytest.mark.parametrize("confidence", ["1.5", "-0.1", "null"])
def test_a_confidence_that_is_no_probability_is_refused(confidence: str) -> None:
    text = write_clicks(CLICKS, unconfirmed=UnconfirmedClicks(("a",), 0.875)).replace("0.875", confidence)
    with pytest.raises(InputError, match=r"unconfirmed\.confidence"):
        read_clicks(text)
