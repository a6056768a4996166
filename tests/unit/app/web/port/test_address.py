"""Addresses, ports and tokens that cannot be used are refused with a clear error before anything is opened."""

import pytest

from app.web.port.address import AddressError, require_address, require_token


@pytest.mark.parametrize("port", [-1, 65536, 99999])
def test_a_number_that_is_not_a_port_is_refused(port: int) -> None:
    with pytest.raises(AddressError, match=rf"--port {port}: not a valid port; give 0 .* to 65535"):
        require_address("127.0.0.1", port)


def test_an_address_of_another_machine_is_refused() -> None:
    with pytest.raises(AddressError, match=r"--host 203\.0\.113\.5: cannot serve on this address"):
        require_address("203.0.113.5", 8080)


def test_a_name_that_does_not_exist_is_refused() -> None:
    with pytest.raises(AddressError, match=r"--host not\.a\.host\.invalid: cannot serve on this address"):
        require_address("not.a.host.invalid", 8080)


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "0.0.0.0"])
def test_addresses_of_this_machine_are_accepted(host: str) -> None:
    require_address(host, 8080)


@pytest.mark.parametrize("token", ["", "  "])
def test_an_empty_token_is_refused(token: str) -> None:
    with pytest.raises(AddressError, match="empty"):
        require_token(token)


def test_no_token_and_a_real_one_are_accepted() -> None:
    require_token(None)
    require_token("secret")
