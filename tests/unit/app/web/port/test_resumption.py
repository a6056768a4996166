"""After a restart, an open page is admitted again by a secret that no request carries."""

import hashlib
import hmac
import json
import os
import sys
from urllib.parse import urlencode

import pytest

from cocalib.web.port.resumption import Resumption, Ticket
from tests.image_recording import ImageRecording, grey_images
from tests.port_client import come_in, get
from tests.serving import serving

ORIGIN = "http://127.0.0.1:8080"


def signed(ticket: Ticket, challenge: str, origin: str = ORIGIN) -> str:
    return hmac.new(bytes.fromhex(ticket.secret), f"{challenge}\n{origin}".encode(), hashlib.sha256).hexdigest()


def proven(server: Resumption, ticket: Ticket, *, challenge: str | None = None, origin: str = ORIGIN) -> bool:
    challenge = challenge or server.challenge()
    proof = signed(ticket, challenge, origin)
    return server.is_proven(ticket=ticket.ticket, challenge=challenge, proof=proof, origin=ORIGIN)


def test_a_ticket_outlives_the_server_and_is_for_one_session_and_one_port():
    """A server of another user on the port of ours cannot pass the page's proof on to ours on the next port."""
    ticket = Resumption("a").ticket()
    assert proven(Resumption("a"), ticket)
    assert not proven(Resumption("b"), ticket)
    assert not proven(Resumption("a"), ticket, origin="http://127.0.0.1:8081")


def test_a_challenge_is_accepted_once_and_not_for_long():
    now = [1_000_000.0]
    server = Resumption("a", wall=lambda: now[0])
    ticket, challenge = server.ticket(), server.challenge()
    assert proven(server, ticket, challenge=challenge)
    assert not proven(server, ticket, challenge=challenge)
    late = server.challenge()
    now[0] += 31
    assert not proven(server, ticket, challenge=late)
    assert not proven(server, ticket, challenge="made up")


def test_a_ticket_has_an_end_that_cannot_be_moved():
    now = [1_000_000.0]
    server = Resumption("a", wall=lambda: now[0])
    ticket = server.ticket()
    now[0] += 24 * 3600 + 1
    assert not proven(server, ticket)
    moved = Ticket(ticket.ticket.partition(".")[0] + ".9999999999", ticket.secret)
    assert not proven(server, moved)


@pytest.mark.parametrize("name", ["", ".", "x.", "x.y", "x.٣", "x." + "9" * 400, "\udcff.1"])
def test_nonsense_is_refused(name):
    server = Resumption("a")
    assert not server.is_proven(ticket=name, challenge=server.challenge(), proof="\udcff", origin=ORIGIN)


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX permissions")
@pytest.mark.parametrize("kind", ["readable", "short", "link", "pipe"])
def test_a_key_file_that_others_may_know_is_not_used(state, kind):
    state.mkdir(parents=True)
    key = state / "page.key"
    if kind == "pipe":
        os.mkfifo(key, 0o600)
    elif kind == "link":
        (state / "elsewhere").write_bytes(bytes(32))
        (state / "elsewhere").chmod(0o600)
        key.symlink_to(state / "elsewhere")
    else:
        key.write_bytes(bytes(5 if kind == "short" else 32))
        key.chmod(0o644 if kind == "readable" else 0o600)
    assert not proven(Resumption("a"), Resumption("a").ticket())


def test_a_page_comes_back_after_a_restart_but_its_cookie_alone_does_not(tmp_path):
    recording, folder = ImageRecording(grey_images(1)), tmp_path / "s"
    with serving(recording, folder, session="a") as (first, _):
        cookie, port = come_in(first), first.port
        assert get(first, "/api/ticket").status == 401
        ticket = Ticket(**json.loads(get(first, "/api/ticket", Cookie=cookie).body))
    with serving(recording, folder, session="a", port=port) as (second, _):
        assert second.port == port
        assert get(second, "/", Cookie=cookie).status == 401
        challenge = json.loads(get(second, "/api/challenge").body)["challenge"]
        proof = signed(ticket, challenge, f"http://127.0.0.1:{port}")
        query = urlencode({"ticket": ticket.ticket, "challenge": challenge, "proof": proof})
        answer = get(second, f"/api/resume?{query}")
        assert answer.status == 200
        fresh = answer.headers["Set-Cookie"].partition(";")[0]
        assert fresh != cookie
        assert get(second, "/", Cookie=fresh).status == 200
        assert get(second, f"/api/resume?{query}").status == 401, "the challenge is used up"
