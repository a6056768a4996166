"""Only schedulers on this machine or behind TLS are used."""

import pytest

from calib_core.errors import InputError
from cocalib.batch.engines.scheduler_address import checked_address


@pytest.mark.parametrize(
    "address",
    ["tcp://127.0.0.1:8786", "tcp://localhost:1", "tcp://[::1]:8786", "tls://10.0.0.7:8786", "tls://head.example:8786"],
)
def test_this_machine_and_tls_are_accepted(address: str) -> None:
    assert checked_address(address) == address


@pytest.mark.parametrize(
    "address", ["tcp://10.0.0.7:8786", "tcp://head.example:8786", "tcp://127.0.0.1.example:8786", "tcp://[fe80::1]:1"]
)
def test_another_machine_without_tls_is_refused_with_the_reason(address: str) -> None:
    with pytest.raises(InputError, match=r"without TLS is refused.*run code.*tls://"):
        checked_address(address)


@pytest.mark.parametrize(
    "address",
    ["", "8786", "localhost:8786", "http://127.0.0.1:8786", "tcp://127.0.0.1", "tcp://:8786", "tcp://127.0.0.1:port",
     "tcp://127.0.0.1:99999", "tcp://[::1:8786", "inproc://1/2", "tcp://127.0.0.1:8786/x", "tcp://u@127.0.0.1:8786"],
)  # fmt: skip
def test_what_is_no_address_is_refused_with_an_example(address: str) -> None:
    with pytest.raises(InputError, match=r"not an address of a Dask scheduler; write tcp://127\.0\.0\.1:8786"):
        checked_address(address)
