"""--map: which column holds which quantity, in which unit and with which sign."""

import math

import pytest

from calib_core.errors import OptionError
from calib_core.recordings.field_words import MappedColumn, parse_column_map


def test_a_map_names_quantity_column_and_unit():
    assert parse_column_map(["x=posX:m", "range=dist:cm"]) == (
        MappedColumn("x", "posX", "m"),
        MappedColumn("range", "dist", "cm"),
    )


def test_a_minus_turns_the_sign():
    (azimuth,) = parse_column_map(["azimuth=-target.theta:deg"])
    assert azimuth.column == "target.theta"
    assert azimuth.scale == pytest.approx(-math.pi / 180.0)


def test_the_words_of_a_map_parse_to_the_same_map():
    for text in ("x=posX:m", "azimuth=-theta:deg", "amplitude=rcs value", "time=stamp:us"):
        (column,) = parse_column_map([text])
        assert column.words == text
        assert parse_column_map([column.words]) == (column,)


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["x"], "QUANTITY=COLUMN:UNIT"),
        (["width=w:m"], "unknown quantity 'width'"),
        (["x=posX:deg"], "unknown unit 'deg' of x; known: m, cm"),
        (["x=a:m", "x=b:m"], "x is already read from 'a'"),
    ],
)
def test_a_map_that_cannot_be_meant_is_refused(texts, said):
    with pytest.raises(OptionError, match=said):
        parse_column_map(texts)
