"""Who may talk to the studio: real connections to a running one, with and without the token of its start."""

from __future__ import annotations

import asyncio
import http.client
import socket
import stat
import threading
import webbrowser
from collections.abc import Callable, Coroutine
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar
from urllib.parse import unquote, urlsplit

import pytest
import viser
import websockets.asyncio.server
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from sidestep.cli import studio_command
from sidestep.studio.guard import Guard, placed
from sidestep.studio.headless import Window, go_to, new_page
from sidestep.studio.server import guarded_server
from sidestep.studio.studio import Studio
from studio.looker import NO_CHROMIUM, PATIENCE

TOO_LATE = 20.0  # [s]
PROTOCOL = f"viser-v{viser.__version__}"
Result = TypeVar("Result")


def run_apart(work: Coroutine[Any, Any, Result]) -> Result:
    """Runs a coroutine in another thread: in this one Playwright keeps a loop running, once a test has started it."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


def token_of(studio: Studio) -> str:
    return urlsplit(studio.address).path.strip("/")


def shake_hands(
    studio: Studio, path: str, *, host: str = "localhost:{port}", origin: str | None = None
) -> bytes | int:
    """What a websocket is sent first, or the status that it is refused with."""

    async def talk() -> bytes | int:
        address = f"ws://{host.format(port=studio.port)}{path}"
        told = origin and origin.format(port=studio.port)
        options: Any = {"subprotocols": [PROTOCOL], "origin": told, "max_size": None, "proxy": None}
        try:
            async with connect(address, host="127.0.0.1", port=studio.port, **options) as connection:
                first = await asyncio.wait_for(connection.recv(), TOO_LATE)
                assert isinstance(first, bytes)
                return first
        except InvalidStatus as error:
            return error.response.status_code

    return run_apart(talk())


def ask(studio: Studio, path: str, headers: tuple[tuple[str, str], ...]) -> tuple[int, bytes]:
    """Status and body of an answer to GET with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", studio.port, timeout=TOO_LATE)
    try:
        connection.putrequest("GET", path, skip_host=True, skip_accept_encoding=True)
        for name, value in headers:
            connection.putheader(name, value.format(port=studio.port))
        connection.endheaders()
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


def test_these_tests_run_beside_a_loop_that_runs_already(studio: Studio) -> None:
    """As it does in this thread once a test has started a browser."""

    async def ask_inside() -> bytes | int:
        return shake_hands(studio, "/")

    assert run_apart(ask_inside()) == 403


def test_a_token_is_random_and_of_one_start(studio: Studio) -> None:
    tokens = {Guard("127.0.0.1").token for _ in range(3)} | {token_of(studio)}
    assert len(tokens) == 4
    assert min(map(len, tokens)) >= 43  # of 64 signs each: 256 bits


def test_the_token_goes_to_the_number_that_the_server_listens_at(studio: Studio) -> None:
    """Where ::1 is another user's, a browser that asks for localhost would tell that user the token."""
    assert urlsplit(studio.address).hostname == studio.host == "127.0.0.1"


@pytest.mark.parametrize("path", ["", "/", "/{wrong}/", "/{short}/", "/x{token}/", "/?{token}", "//{token}/"])
def test_without_the_token_nobody_is_let_in(studio: Studio, path: str) -> None:
    token = token_of(studio)
    wrong = token[:-1] + ("A" if token[-1] != "A" else "B")
    path = path.format(token=token, wrong=wrong, short=token[:-1])
    assert shake_hands(studio, path) == 403
    assert ask(studio, path or "/", (("Host", "localhost:{port}"),))[0] == 403


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://evil.example:{port}",
        "http://localhost",
        "http://localhost:1",
        "https://localhost:{port}",
        "http://127.0.0.1:{port}",  # the page is at localhost
        "http://localhost:{port}.evil.example",
        "null",
    ],
)
def test_pages_of_others_are_refused_even_with_the_token(studio: Studio, origin: str) -> None:
    path = urlsplit(studio.address).path
    assert shake_hands(studio, path, origin=origin) == 403
    assert ask(studio, path, (("Host", "localhost:{port}"), ("Origin", origin)))[0] == 403


@pytest.mark.parametrize("host", ["evil.example:{port}", "localhost.evil.example:{port}", "10.1.2.3:{port}"])
@pytest.mark.parametrize("origin", [None, "same"])
def test_a_foreign_name_that_leads_here_is_refused(studio: Studio, host: str, origin: str | None) -> None:
    path = urlsplit(studio.address).path
    told = f"http://{host}" if origin else None
    assert shake_hands(studio, path, host=host, origin=told) == 403
    assert ask(studio, path, (("Host", host), *((("Origin", told),) if told else ())))[0] == 403


@pytest.mark.parametrize(
    "headers",
    [
        (),
        (("Host", "localhost"),),
        (("Host", "localhost:1"),),
        (("Host", "x@localhost:{port}"),),
        (("Host", "localhost:{port}/"),),
        (("Host", "[localhost:{port}"),),
        (("Host", "localhost:{port}"), ("Host", "evil.example")),
        (
            ("Host", "localhost:{port}"),
            ("Origin", "http://localhost:{port}"),
            ("Origin", "http://evil.example"),
        ),
    ],
)
def test_headers_that_do_not_say_one_thing_are_refused(
    studio: Studio, headers: tuple[tuple[str, str], ...]
) -> None:
    assert ask(studio, urlsplit(studio.address).path, headers)[0] == 403


def test_a_path_that_is_no_text_is_refused(studio: Studio) -> None:
    with socket.create_connection(("127.0.0.1", studio.port), timeout=TOO_LATE) as raw:
        raw.sendall(b"GET /\xff\xfe/ HTTP/1.1\r\nHost: localhost:%d\r\n\r\n" % studio.port)
        assert raw.recv(64).startswith(b"HTTP/1.1 403 ")


@pytest.mark.parametrize("host", ["localhost:{port}", "127.0.0.1:{port}"])
@pytest.mark.parametrize("origin", [None, "same"])
def test_with_the_token_page_and_websocket_answer(studio: Studio, host: str, origin: str | None) -> None:
    path = urlsplit(studio.address).path
    for form in (path, path.rstrip("/"), f"{path}?a=b"):
        told = f"http://{host}" if origin else None
        first = shake_hands(studio, form, host=host, origin=told)
        assert isinstance(first, bytes)
        assert len(first) > 16  # of the scene
        status, body = ask(studio, form, (("Host", host), *((("Origin", told),) if told else ())))
        assert status == 200
        assert b"<html" in body


@pytest.mark.parametrize(
    ("host", "own", "foreign"),
    [
        (
            "127.0.0.1",
            ["localhost:81", "127.0.0.1:81", "LOCALHOST:81"],
            ["localhost", "localhost:82", "8.8.8.8:81"],
        ),
        ("localhost", ["localhost:81", "[::1]:81"], ["evil.example:81", "0.0.0.0:81"]),
        ("::1", ["[::1]:81", "localhost:81"], ["::1:81", "[::2]:81"]),
        ("192.168.1.2", ["192.168.1.2:81"], ["localhost:81", "192.168.1.3:81"]),
        ("Robot.local", ["robot.local:81"], ["robot:81", "localhost:81"]),
        ("fe80:0::2", ["[fe80::2]:81"], ["[fe80::3]:81"]),
        (
            "0.0.0.0",
            [
                "localhost:81",
                "192.168.1.2:81",
                f"{socket.gethostname()}:81",
                f"{socket.gethostname()}.local:81",
            ],
            ["evil.example:81", "192.168.1.2.evil.example:81", "192.168.1.2:82", "192.168.1.2"],
        ),
        ("::", ["[fe80::2]:81", "localhost:81"], ["evil.example:81"]),
    ],
)
def test_a_server_knows_its_own_names(host: str, own: list[str], foreign: list[str]) -> None:
    guard = Guard(host)
    assert [place for place in own if not guard.is_own(place, 81)] == []
    assert [place for place in foreign if guard.is_own(place, 81)] == []
    for place in own:  # the port of HTTP is left out of addresses
        assert guard.is_own(place.removesuffix(":81"), 80)


def test_a_server_for_all_asks_for_the_token_too() -> None:
    guard = Guard("0.0.0.0")
    server = guarded_server("0.0.0.0", 0, guard)
    try:
        running: Any = SimpleNamespace(port=server.get_port())
        assert shake_hands(running, "/", host="127.0.0.1:{port}") == 403
        assert ask(running, "/", (("Host", "127.0.0.1:{port}"),))[0] == 403
        assert isinstance(shake_hands(running, f"/{guard.token}/", host="127.0.0.1:{port}"), bytes)
    finally:
        server.stop()


def test_a_viser_that_cannot_be_guarded_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    stopped = []
    unguarded = SimpleNamespace(stop=lambda: stopped.append(True))
    monkeypatch.setattr(viser, "ViserServer", lambda **_: unguarded)
    with pytest.raises(RuntimeError, match=r"starts its server in a way that the studio cannot guard"):
        guarded_server("127.0.0.1", 0, Guard("127.0.0.1"))
    assert stopped == [True]


def test_servers_of_others_are_left_alone() -> None:
    before = websockets.asyncio.server.serve
    heard: list[str] = []

    def answer(connection: Any, request: Any) -> Any:
        heard.append(request.path)
        return connection.respond(200, "mine")

    async def run() -> int:
        async with websockets.asyncio.server.serve(
            lambda connection: asyncio.sleep(0.0), "127.0.0.1", 0, process_request=answer
        ) as server:
            port = next(iter(server.sockets)).getsockname()[1]
            status, _ = await asyncio.to_thread(ask, SimpleNamespace(port=port), "/", (("Host", "any"),))  # type: ignore[arg-type]
            return status

    guard = Guard("127.0.0.1")
    with placed(guard):
        assert run_apart(run()) == 200
    assert heard == ["/"]
    assert not guard.placed
    assert websockets.asyncio.server.serve is before


def test_the_address_is_not_on_the_command_line_of_the_browser(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(webbrowser, "open", opened.append)
    with studio_command.open_browser("http://localhost:80/secret/"):
        (address,) = opened
        assert "secret" not in address
        file = Path(unquote(urlsplit(address).path))
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert 'content="0; url=http://localhost:80/secret/"' in file.read_text(encoding="utf-8")
        assert file.parent == tmp_path
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@NO_CHROMIUM
def test_the_file_that_is_opened_leads_to_the_page(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, studio: Studio, chromium: Any
) -> None:
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    page = new_page(chromium, Window(640, 480))
    monkeypatch.setattr(webbrowser, "open", lambda address: go_to(page, address))
    try:
        with studio_command.open_browser(studio.address):
            assert page.url.startswith(studio.address)
            assert page.locator("#words").inner_text() != ""
            page.reload()  # at the address that viser has made of it
            page.wait_for_selector("#words", timeout=1e3 * PATIENCE)
    finally:
        page.close()


@pytest.mark.slow
@NO_CHROMIUM
def test_another_page_in_the_same_browser_cannot_connect(
    studio: Studio, chromium: Any, serve_page: str
) -> None:
    """Not even one of this machine that knows the token."""
    page = new_page(chromium, Window(640, 480))
    try:
        page.goto(serve_page)
        script = """([address, protocol]) => new Promise(done => {
            const socket = new WebSocket(address, [protocol]);
            socket.onopen = () => done('open'); socket.onerror = () => done('refused'); })"""
        address = studio.address.replace("http://", "ws://", 1)
        assert page.evaluate(script, [address, PROTOCOL]) == "refused"
        refused = page.goto(studio.address.replace(token_of(studio), "x"))
        assert refused.status == 403
        assert "address that the studio has printed" in page.inner_text("body")
    finally:
        page.close()


@pytest.fixture
def serve_page() -> Any:
    """Address of an empty page on another port of this machine."""
    from http.server import BaseHTTPRequestHandler, HTTPServer

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html>")

        log_message: Callable[..., None] = lambda *_: None

    server = HTTPServer(("127.0.0.1", 0), Page)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()
    thread.join()
