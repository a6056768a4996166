"""Which hosts are this machine."""

from cocalib.platform.loopback import is_loopback


def test_loopback_is_recognised():
    hosts = ("127.0.0.1", "127.9.9.9", "localhost", "::1", "0.0.0.0", "10.0.0.1", "x")
    assert [host for host in hosts if is_loopback(host)] == ["127.0.0.1", "127.9.9.9", "localhost", "::1"]
