"""Text never becomes markup, and what is written is well-formed."""

import xml.etree.ElementTree as ElementTree

from hypothesis import given
from hypothesis import strategies as st

from cocalib.report.markup import number, tag


@given(st.text(max_size=50), st.text(max_size=50))
def test_any_text_stays_text(words, attribute):
    found = ElementTree.fromstring(tag("p", words, title=attribute).text)
    assert not len(found)
    assert len(found.text or "") == len(words)


def test_markup_in_text_is_escaped_and_hidden_characters_are_shown():
    assert tag("p", "<script>&\"'").text == "<p>&lt;script&gt;&amp;&quot;&#x27;</p>"
    assert tag("p", "a\u202eb\x00").text == "<p>a\ufffdb\ufffd</p>"


def test_endless_text_is_cut_but_a_long_path_is_not():
    assert len(tag("p", "x" * 10_000).text) < 1000
    assert len(tag("path", d="M0 0" * 1000).text) > 4000


def test_coordinates_have_two_decimals_at_most_and_no_negative_zero():
    assert [number(value) for value in (1.0, -0.001, 2.345, -10.5)] == ["1", "0", "2.35", "-10.5"]
