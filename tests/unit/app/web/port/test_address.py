"""Addresses, ports and tokens that cannot be used are refused with a clear error before anything is opened."""

from pathlib import Path

import pytest

from cocalib.web.port.address import AddressError, require_address, require_one_address, require_token


@pytest.mark.parametrize("port", [-1, 65536, 99999])
def test_a_number_that_is_not_a_port_is_refused(port):
    with pytest.raises(AddressError, match=rf"--port {port}: not a valid port; give 0 .* to 65535"):
        require_address("127.0.0.1", port)


def test_an_address_of_another_machine_is_refused():
    with pytest.raises(AddressError, match=r"--host 203\.0\.113\.5: cannot serve on this address"):
        require_address("203.0.113.5", 8080)


def test_a_name_that_does_not_exist_is_refused():
    with pytest.raises(AddressError, match=r"--host not\.a\.host\.invalid: cannot serve on this address"):
        require_address("not.a.host.invalid", 8080)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0"])
def test_addresses_of_this_machine_are_accepted(host):
    require_address(host, 8080)


@pytest.mark.parametrize("reachable", [False, True])
@pytest.mark.parametrize("token", ["", "  "])
def test_an_empty_token_is_refused(token, reachable):
    with pytest.raises(AddressError, match="empty"):
        require_token(token, reachable=reachable)


@pytest.mark.parametrize(
    ("token", "reachable"),
    [
        ("x", False),
        ("abcdefg", False),
        ("aaaaaaaaaa", False),
        ("abcdefgh", True),
        ("a" * 40, True),
        ("abcdefghijklmno", True),
    ],
)
def test_a_token_that_could_be_guessed_is_refused(token, reachable):
    with pytest.raises(AddressError, match="16 characters" if reachable else "8 characters"):
        require_token(token, reachable=reachable)


@pytest.mark.parametrize("token", [None, "abcdefghijklmnop"])
@pytest.mark.parametrize("reachable", [False, True])
def test_no_token_and_a_long_one_are_accepted(token, reachable):
    require_token(token, reachable=reachable)


def test_a_unix_socket_takes_the_place_of_an_address():
    require_one_address(None, "0.0.0.0")
    require_one_address(Path("s"), "127.0.0.1")
    with pytest.raises(AddressError, match="give one"):
        require_one_address(Path("s"), "0.0.0.0")
