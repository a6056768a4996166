"""The guard: nobody gets access except through the link."""

import pytest

from cocalib.web.port.guard import MAX_IDLE_S, Admissions, Admitted, Allowed, Guard, Refused, Request


def request(path: str = "/", **headers: str | list[str]) -> Request:
    given = {"host": "127.0.0.1:8080", **headers}
    return Request(
        path, {name: value if isinstance(value, list) else [value] for name, value in given.items() if value}
    )


class Clock:
    """A clock that a test sets."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


class Door(Guard):
    """A guard together with its admissions and the cookie of one admitted browser."""

    def __init__(self, *, session: str = "a", clock: Clock | None = None, **changes: object) -> None:
        self.clock = clock or Clock()
        self.admissions = Admissions(session, self.clock)
        super().__init__(self.admissions, **{"host": "127.0.0.1", **changes})
        self.value = self.admissions.admit()
        self.cookie = f"{self.admissions.cookie_name}={self.value}"


def allowed(door: Guard, asked: Request) -> bool:
    return isinstance(door.check(asked), Allowed)


def status(verdict: object) -> int:
    assert isinstance(verdict, Refused), verdict
    return verdict.status


def test_the_link_admits_once_and_its_cookie_stays_valid():
    door = Door()
    link = f"/?token={door.token}"
    admitted = door.check(request(link))
    assert isinstance(admitted, Admitted)
    assert status(door.check(request(link))) == 401
    header = door.admissions.set_cookie(admitted.cookie)
    assert "HttpOnly" in header
    assert "SameSite=Strict" in header
    assert "Max-Age=" in header
    cookie = header.partition(";")[0]
    assert allowed(door, request("/", cookie=cookie))
    assert isinstance(door.check(request(link, cookie=cookie)), Admitted), (
        "reloading the used link must work with the cookie"
    )


def test_after_a_link_was_used_the_next_one_works():
    door = Door()
    first = door.token
    door.check(request(f"/?token={first}"))
    assert door.token != first
    assert isinstance(door.check(request(f"/?token={door.token}")), Admitted)


@pytest.mark.parametrize("method", ["HEAD", "POST", "OPTIONS"])
def test_only_opening_a_link_uses_it_up(method):
    door = Door()
    link = f"/?token={door.token}"
    preview = Request(link, {"host": ["127.0.0.1:8080"]}, method)
    assert status(door.check(preview)) == 401
    assert isinstance(door.check(request(link)), Admitted)


def test_a_token_chosen_by_the_user_stays_valid():
    door = Door(token="mine")
    assert isinstance(door.check(request("/?token=mine")), Admitted)
    assert isinstance(door.check(request("/?token=mine")), Admitted)
    assert status(door.check(request("/?token=other"))) == 401


@pytest.mark.parametrize("session", ["a", "b"])
def test_a_cookie_is_for_one_server_only_and_those_of_other_sessions_do_not_overwrite_it(session):
    one, other = Door(session="a"), Door(session=session)
    assert allowed(one, request(cookie=one.cookie))
    assert status(other.check(request(cookie=one.cookie))) == 401
    stolen = f"{other.admissions.cookie_name}={one.value}"
    assert status(other.check(request(cookie=stolen))) == 401
    if session == "b":
        assert one.admissions.cookie_name != other.admissions.cookie_name
        both = f"{other.cookie}; {one.cookie}"
        assert allowed(one, request(cookie=both))
        assert allowed(other, request(cookie=both))


def test_an_admission_ends_when_it_is_not_used():
    door = Door()
    for _ in range(5):
        door.clock.now += MAX_IDLE_S - 1
        assert allowed(door, request(cookie=door.cookie)), "each use renews it"
    door.clock.now += MAX_IDLE_S + 1
    assert status(door.check(request(cookie=door.cookie))) == 401
    door.clock.now -= MAX_IDLE_S
    assert status(door.check(request(cookie=door.cookie))) == 401, "it has ended for good"


def test_a_page_that_is_open_all_day_stays_admitted():
    door = Door()
    door.admissions.opened(door.value)
    door.clock.now += 30 * MAX_IDLE_S
    assert allowed(door, request(cookie=door.cookie))
    door.clock.now += 2 * MAX_IDLE_S
    door.admissions.closed(door.value)
    assert allowed(door, request(cookie=door.cookie))
    door.clock.now += 2 * MAX_IDLE_S
    assert status(door.check(request(cookie=door.cookie))) == 401


def test_admissions_do_not_pile_up_and_open_pages_stay():
    door = Door(token="mine")
    door.admissions.opened(door.value)
    for _ in range(1000):
        door.clock.now += 1
        door.check(request("/?token=mine"))
    assert len(door.admissions._last_use) <= 256
    assert allowed(door, request(cookie=door.cookie))


@pytest.mark.parametrize("value", ["", "0", "nonsense", "\u00e4", "\udce4", "="])
def test_without_the_cookie_nothing_is_served(value):
    door = Door()
    for cookie in (value, f"{door.admissions.cookie_name}={value}", f"other=1; {door.admissions.cookie_name}={value}"):
        assert status(door.check(request("/", cookie=cookie))) == 401
        assert status(door.check(request("/api/clicks.json", cookie=cookie))) == 401


def test_a_token_does_not_open_a_websocket():
    door = Door()
    opening = request(f"/ws?token={door.token}", upgrade="websocket", origin="http://127.0.0.1:8080")
    assert status(door.check(opening)) == 401
    assert isinstance(door.check(request(f"/?token={door.token}")), Admitted), "the attempt must not use up the token"


FOREIGN = ("evil.example", "evil.example:8080", "127.0.0.1.evil.example", "192.168.0.7:8080", "[::2]", "localhost:80:80",
           "127.0.0.1:8080@evil.example", "127.0.0.1:evil.example", "[::1].evil.example", "[::1]@evil.example")  # fmt: skip
OURS = ("127.0.0.1:8080", "localhost:8080", "LOCALHOST:9000", "[::1]:8080", "127.0.0.1")


@pytest.mark.parametrize("host", [*FOREIGN, *OURS])
def test_names_of_this_machine_are_answered_under_any_port_for_tunnels_and_no_others(host):
    door = Door()
    verdict = door.check(request(host=host, cookie=door.cookie))
    assert isinstance(verdict, Allowed) if host in OURS else status(verdict) == 421


@pytest.mark.parametrize("hosts", [[], ["127.0.0.1", "evil.example"]])
def test_a_request_has_exactly_one_host(hosts):
    assert status(Door().check(Request("/", {"host": hosts, "cookie": [Door().cookie]}))) == 400


@pytest.mark.parametrize("path", ["/ws", "/viser/abc", "/"])
@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:9999", "http://localhost:8080", "null", ""]
)
def test_a_request_from_another_origin_is_refused_and_a_websocket_from_none(path, origin):
    door = Door()
    for upgrade in ("websocket", "WebSocket"):
        assert status(door.check(request(path, upgrade=upgrade, origin=origin, cookie=door.cookie))) == 403
        assert allowed(door, request(path, upgrade=upgrade, origin="http://127.0.0.1:8080", cookie=door.cookie))
    plain = request(path, origin=origin, cookie=door.cookie)
    assert allowed(door, plain) if not origin else status(door.check(plain)) == 403


def test_bound_to_the_network_it_answers_to_addresses_but_not_to_strange_names():
    door = Door(host="0.0.0.0", more_hosts=["bench.local"])
    assert allowed(door, request(host="192.168.0.7:8080", cookie=door.cookie))
    assert allowed(door, request(host="bench.local:8080", cookie=door.cookie))
    assert status(door.check(request(host="evil.example:8080", cookie=door.cookie))) == 421


def test_only_tokens_that_may_be_guessed_wait_for_their_turn():
    generated, chosen = Door(), Door(token="mine")
    assert not generated.tries_token(request("/"))
    assert generated.tries_token(request("/?token=wrong"))
    assert not generated.tries_token(request(f"/?token={generated.token}"))
    assert chosen.tries_token(request("/?token=mine"))
    assert not chosen.tries_token(request("/?token=wrong", cookie=chosen.cookie)), "an admitted page never waits"
