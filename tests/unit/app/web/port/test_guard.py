"""The guard: nobody gets access except through the link."""

import pytest

from app.web.port.guard import Admitted, Allowed, Guard, Refused, Request, is_loopback

KEY = b"k" * 32


def request(path: str = "/", **headers: str | list[str]) -> Request:
    given = {"host": "127.0.0.1:8080", **headers}
    return Request(
        path, {name: value if isinstance(value, list) else [value] for name, value in given.items() if value}
    )


def guard(**changes: object) -> Guard:
    return Guard(**{"host": "127.0.0.1", "key": KEY, **changes})  # type: ignore[arg-type]


def status(verdict: object) -> int:
    assert isinstance(verdict, Refused), verdict
    return verdict.status


def test_the_link_admits_once_and_its_cookie_stays_valid() -> None:
    door = guard()
    link = f"/?token={door.token}"
    admitted = door.check(request(link))
    assert isinstance(admitted, Admitted)
    assert admitted.location == "/"
    assert "HttpOnly" in admitted.set_cookie
    assert "SameSite=Strict" in admitted.set_cookie
    assert status(door.check(request(link))) == 401
    cookie = admitted.set_cookie.partition(";")[0]
    assert door.check(request("/", cookie=cookie)) == Allowed()
    assert isinstance(door.check(request(link, cookie=cookie)), Admitted), (
        "reloading the used link must work with the cookie"
    )


def test_after_a_link_was_used_the_next_one_works() -> None:
    door = guard()
    first = door.token
    door.check(request(f"/?token={first}"))
    assert door.token != first
    assert isinstance(door.check(request(f"/?token={door.token}")), Admitted)


def test_a_token_chosen_by_the_user_stays_valid() -> None:
    door = guard(token="mine")
    assert isinstance(door.check(request("/?token=mine")), Admitted)
    assert isinstance(door.check(request("/?token=mine")), Admitted)
    assert status(door.check(request("/?token=other"))) == 401


def test_a_cookie_outlives_the_process_with_its_key_and_no_other() -> None:
    assert guard().check(request(cookie=guard().cookie)) == Allowed()
    assert status(guard(key=b"x" * 32).check(request(cookie=guard().cookie))) == 401


@pytest.mark.parametrize("cookie", ["", "cocalib=", "cocalib=0", "other=1; cocalib=nonsense", "cocalib=\u00e4"])
def test_without_the_cookie_nothing_is_served(cookie: str) -> None:
    assert status(guard().check(request("/", cookie=cookie))) == 401
    assert status(guard().check(request("/api/clicks.json", cookie=cookie))) == 401


def test_a_token_does_not_open_a_websocket() -> None:
    door = guard()
    opening = request(f"/ws?token={door.token}", upgrade="websocket", origin="http://127.0.0.1:8080")
    assert status(door.check(opening)) == 401
    assert isinstance(door.check(request(f"/?token={door.token}")), Admitted), "the attempt must not use up the token"


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8080", "127.0.0.1.evil.example", "192.168.0.7:8080", "[::2]"]
)
def test_a_foreign_host_name_is_not_answered(host: str) -> None:
    assert status(guard().check(request(host=host, cookie=guard().cookie))) == 421


@pytest.mark.parametrize("host", ["127.0.0.1:8080", "localhost:8080", "LOCALHOST:9000", "[::1]:8080", "127.0.0.1"])
def test_names_of_this_machine_are_answered_under_any_port_for_tunnels(host: str) -> None:
    assert guard().check(request(host=host, cookie=guard().cookie)) == Allowed()


@pytest.mark.parametrize("hosts", [[], ["127.0.0.1", "evil.example"]])
def test_a_request_has_exactly_one_host(hosts: list[str]) -> None:
    assert status(guard().check(Request("/", {"host": hosts, "cookie": [guard().cookie]}))) == 400


@pytest.mark.parametrize("path", ["/ws", "/viser/abc", "/"])
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:9999", "http://localhost:8080", "null", ""]
)
def test_a_websocket_from_another_origin_or_none_is_refused(path: str, origin: str) -> None:
    opening = request(path, upgrade="websocket", origin=origin, cookie=guard().cookie)
    assert status(guard().check(opening)) == 403


def test_a_websocket_of_our_own_page_is_let_in() -> None:
    opening = request("/ws", upgrade="WebSocket", origin="http://127.0.0.1:8080", cookie=guard().cookie)
    assert guard().check(opening) == Allowed()


def test_a_plain_request_that_names_another_origin_is_refused() -> None:
    assert (
        status(guard().check(request("/api/clicks.json", origin="http://evil.example", cookie=guard().cookie))) == 403
    )


def test_bound_to_the_network_it_answers_to_addresses_but_not_to_strange_names() -> None:
    door = guard(host="0.0.0.0", more_hosts=["bench.local"])
    assert door.check(request(host="192.168.0.7:8080", cookie=door.cookie)) == Allowed()
    assert door.check(request(host="bench.local:8080", cookie=door.cookie)) == Allowed()
    assert status(door.check(request(host="evil.example:8080", cookie=door.cookie))) == 421


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("localhost", True),
        ("::1", True),
        ("0.0.0.0", False),
        ("10.0.0.1", False),
        ("x", False),
    ],
)
def test_loopback_is_recognised(host: str, expected: bool) -> None:
    assert is_loopback(host) is expected
