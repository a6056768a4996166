"""Addresses, ports and tokens that cannot be used are refused with a clear error before anything is opened."""

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

import pytest

from cocalib.web.port.address import AddressError, require_address, require_one_address, require_token


def refusal(words: str | None) -> AbstractContextManager[object]:
    return pytest.raises(AddressError, match=words) if words else nullcontext()


@pytest.mark.parametrize(
    ("host", "port", "words"),
    [
        *(("127.0.0.1", port, rf"--port {port}: not a valid port; give 0 .* to 65535") for port in (-1, 65536, 99999)),
        ("203.0.113.5", 8080, r"--host 203\.0\.113\.5: cannot serve on this address"),
        ("not.a.host.invalid", 8080, r"--host not\.a\.host\.invalid: cannot serve on this address"),
        *((host, 8080, None) for host in ("127.0.0.1", "localhost", "0.0.0.0")),
    ],
)
def test_addresses_of_this_machine_are_accepted_and_no_others(host, port, words):
    with refusal(words):
        require_address(host, port)


@pytest.mark.parametrize(
    ("tokens", "reachable", "words"),
    [
        (("", "  "), False, "empty"),
        (("", "  "), True, "empty"),
        (("x", "abcdefg", "aaaaaaaaaa"), False, "8 characters"),
        (("abcdefgh", "a" * 40, "abcdefghijklmno"), True, "16 characters"),
        ((None, "abcdefghijklmnop"), False, None),
        ((None, "abcdefghijklmnop"), True, None),
    ],
)
def test_a_token_that_could_be_guessed_is_refused(tokens, reachable, words):
    for token in tokens:
        with refusal(words):
            require_token(token, reachable=reachable)


def test_a_unix_socket_takes_the_place_of_an_address():
    require_one_address(None, "0.0.0.0")
    require_one_address(Path("s"), "127.0.0.1")
    with pytest.raises(AddressError, match="give one"):
        require_one_address(Path("s"), "0.0.0.0")
