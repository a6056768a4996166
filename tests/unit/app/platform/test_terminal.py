"""What is printed cannot control the terminal."""

import io
import json
import logging
import sys
import traceback

import msgspec
import pytest

from cocalib.platform.terminal import escaped, escaped_output, print_exactly, terminal_stream, with_colours

HOSTILE = {
    "escape": "\x1b[2J\x1b]0;owned\x07",
    "C1": "\x9b2J",
    "DEL": "a\x7f",
    "carriage return": "real\rfake",
    "direction override": "bag\u202egab.",
    "isolates": "\u2066a\u2069",
    "separators": "a\u2028b\u2029c",
    "byte of a file name": "a\udcff",
}


class Terminal(io.StringIO):
    """A terminal in memory."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def terminal_of(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Print to a terminal in memory from now on; pytest sets its own streams before each test begins."""
    shown = Terminal()
    monkeypatch.setattr(sys, "stdout", shown)
    monkeypatch.setattr(sys, "stderr", shown)
    return shown


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_controls_are_shown_as_json_shows_them(text):
    shown = escaped(text)
    assert shown.isprintable()
    assert shown.encode()
    assert json.loads(f'"{shown}"') == text


@pytest.mark.parametrize("text", ["±1.2 µm → /radar/points\n\ttabbed", "Ümlaut, 雷达, 🚗", ""])
def test_ordinary_text_is_unchanged(text):
    assert escaped(text) == text


def test_everything_that_is_printed_or_logged_is_escaped(monkeypatch):
    terminal = terminal_of(monkeypatch)
    with escaped_output():
        print("out \x1b[31m")
        print("err \x1b[32m", file=sys.stderr)
        logging.lastResort.handle(logging.makeLogRecord({"msg": "log \x1b[33m", "levelno": logging.WARNING}))
        traceback.print_exception(ValueError("an error \x1b[34m"))
        sys.stdout.writelines(["line \x1b[35m\n"])
    assert "\x1b" not in terminal.getvalue()
    for number in range(31, 36):
        assert f"\\u001b[{number}m" in terminal.getvalue()
    assert sys.stdout is terminal, "the streams are put back"


def test_json_stays_json_and_keeps_its_values(monkeypatch):
    terminal = terminal_of(monkeypatch)
    value = {"topic": "a\x00\x1b\x7f\x9b\u202e\u2028é"}
    with escaped_output():
        print(msgspec.json.encode(value).decode())
    assert json.loads(terminal.getvalue()) == value
    assert all(character.isprintable() or character == "\n" for character in terminal.getvalue())


def test_of_the_help_only_colours_pass(monkeypatch):
    terminal = terminal_of(monkeypatch)
    with escaped_output():
        with with_colours():
            print("\x1b[1mbold\x1b[0m \x1b[2J")
        print("\x1b[1m")
    assert terminal.getvalue() == "\x1b[1mbold\x1b[0m \\u001b[2J\n\\u001b[1m\n"


def test_a_file_on_stdout_is_exact_in_a_pipe_and_escaped_on_a_terminal(monkeypatch):
    terminal = terminal_of(monkeypatch)
    with escaped_output():
        print_exactly("\u202ex\n")
    assert terminal.getvalue() == "\\u202ex\n"
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stdout", pipe)
    with escaped_output():
        print_exactly("\u202ex\n")
    assert pipe.getvalue() == "\u202ex\n"


def test_a_progress_bar_draws_on_the_terminal_itself(monkeypatch):
    terminal = terminal_of(monkeypatch)
    with escaped_output():
        assert terminal_stream(sys.stderr) is terminal
    assert terminal_stream(terminal) is terminal


def test_a_terminal_without_the_character_does_not_stop_a_command(monkeypatch):
    data = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(data, encoding="ascii", write_through=True))
    with escaped_output():
        print("±")
    assert data.getvalue() == b"\\xb1\n"


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_closed_output_does_not_stop_a_command(monkeypatch, stream):
    monkeypatch.setattr(sys, stream, None)
    with escaped_output():
        print("shown to nobody", file=getattr(sys, stream))
