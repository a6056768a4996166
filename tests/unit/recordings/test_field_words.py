"""The shared vocabulary: a spelling means the same as a column of a table, as a field of a message, and in --map."""

import math
import re

import pytest

from calib_core.errors import OptionError
from calib_core.recordings.field_words import (
    AMBIGUOUS,
    SPELLINGS,
    SUBJECTS,
    UNITS_BY_SPELLING,
    MappedColumn,
    column_meaning,
    is_plain,
    meaning_of,
    parse_column_map,
    spelt,
    unit_in,
    unit_of_word,
)
from calib_core.recordings.plain_files.tables.times import time_name
from calib_core.recordings.radar.column_guess import table_meaning

MEASURED = {"length": "range", "angle": "azimuth", "speed": "doppler", "level": "snr", "time": "time"}

SPELT = spelt(SPELLINGS)


def test_a_spelling_means_the_same_as_a_column_and_as_a_field():
    for spelling in SPELLINGS:
        for name in ("_".join(spelling.words.split()), "target." + ".".join(spelling.words.split())):
            column, field = column_meaning(name), meaning_of(name)
            assert column is not None, name
            assert column.kind == field.kind == spelling.kind, name
            assert (field.rank, field.sigma, field.second) == (spelling.rank, False, False), name


@pytest.mark.parametrize("subject", sorted(SUBJECTS))
def test_the_word_for_a_return_may_precede_columns_and_fields(subject):
    column, field = column_meaning(f"{subject}.pos.x"), meaning_of(f"{subject}.pos.x")
    assert column is not None
    assert column.quantity == field.quantity == "x"
    time = time_name(f"{subject}.timestamp")
    assert time.quantity == "time"


def test_no_words_are_spellings_of_two_kinds():
    for spelling in SPELLINGS:
        (words,) = spelt([spelling])
        assert SPELT[words].kind == spelling.kind, spelling


@pytest.mark.parametrize("spelling", AMBIGUOUS, ids=lambda one: one.words)
def test_an_ambiguous_spelling_is_not_shared(spelling):
    (words,) = spelt([spelling])
    assert words not in SPELT
    assert meaning_of(spelling.words) is not None


@pytest.mark.parametrize(("word", "unit"), UNITS_BY_SPELLING.items())
def test_a_unit_means_the_same_everywhere(word, unit):
    quantity = MEASURED[unit.dimension]
    written = f"{quantity} [{word}]"
    if quantity == "time":
        time = time_name(written)
        assert (time.quantity, time.unit) == (quantity, unit.flag)
    else:
        column = table_meaning(written)
        assert (column.kind, column.unit) == ("radial" if quantity == "doppler" else quantity, unit)
    assert unit_of_word(word) == unit
    if unit.dimension != "time":
        assert unit_in(f"[{word}]", unit.dimension) == unit
    if re.fullmatch(r"\w+", word) and quantity != "snr":
        (mapped,) = parse_column_map([f"{quantity}=column:{word}"])
        assert mapped.scale == unit.scale


@pytest.mark.parametrize(
    ("name", "flag"),
    [
        ("range_cm", "cm"), ("doppler_m_s", "mps"), ("velocity_km_per_h", "kmh"), ("rcs_dBsm", "dbsm"), ("rcs_dBm²", "dbsm"),
        ("rcs_dbm2", "dbsm"), ("azimuth_cdeg", "cdeg"), ("elevation°", "deg"), ("vx_mmps", "mmps"),
    ],
)  # fmt: skip
def test_a_unit_at_the_end_of_a_name_is_the_same_in_tables_and_messages(name, flag):
    column, field = table_meaning(name), meaning_of(name)
    assert column is not None
    assert column.unit == field.unit
    assert field.unit.flag == flag


@pytest.mark.parametrize(
    "name",
    ["dx", "lat", "long", "latitude", "longitude", "position_latitude", "gps_x", "height", "altitude", "alpha", "t_x", "x1", "x2",
     "azimuth2", "ego_x", "they", "latest"],
)  # fmt: skip
def test_names_of_other_things_are_no_columns_of_returns(name):
    assert table_meaning(name) is None


@pytest.mark.parametrize(
    ("name", "quantity", "rank"),
    [("theta", "azimuth", 4), ("angle", "azimuth", 5), ("phi", "azimuth", 3), ("height", "z", 1), ("lat", "y", 1)],
)
def test_messages_keep_their_ambiguous_names(name, quantity, rank):
    meaning = meaning_of(name)
    assert (meaning.quantity, meaning.rank) == (quantity, rank)


def test_only_the_documented_spelling_is_plain():
    names = ("range_m", "f_Range_m", "target.range", "sigma_range_m", "rng_m", "range_filtered", "range_std_m")
    found = {name: meaning for name in names if (meaning := column_meaning(name)) is not None}
    assert [name for name, meaning in found.items() if is_plain(name, meaning)] == [
        "range_m",
        "f_Range_m",
        "target.range",
        "sigma_range_m",
    ]
    assert len(found) == 7


def test_a_unit_with_a_long_s_in_a_comment_is_read_as_any_other():
    unit = unit_in("[m/\u017f]", "speed")
    assert unit.scale == 1.0


# --map: which column holds which quantity, in which unit and with which sign.


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
