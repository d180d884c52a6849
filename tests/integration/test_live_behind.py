"""``fcu web`` below a path prefix and behind a proxy that the user names."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.live import jupyter
from fcu_emulator.emulator.live.public import checked_base_path, checked_behind, given_token
from fcu_emulator.emulator.live.server import PageServer

BASE = "/user/ada/fcu/"
HUB = "https://hub.example"
TOKEN = "t" * 32


@pytest.fixture
def behind() -> Iterator[PageServer]:
    one = PageServer(base_path=BASE, behind=HUB, token=TOKEN)
    yield one
    one.close()


@pytest.fixture
def below() -> Iterator[PageServer]:
    one = PageServer(base_path=BASE)
    yield one
    one.close()


def get(pages: PageServer, path: str, host: str = "hub.example", **headers: str) -> HTTPResponse:
    connection = HTTPConnection("127.0.0.1", pages.address.port, timeout=30)
    connection.request("GET", path, headers={"Host": host, **headers})
    return connection.getresponse()


def refusal(pages: PageServer, path: str, **options: Any) -> int:
    """Return the status of a refused socket, or 0 if it opened."""
    options = {
        "origin": HUB,
        "subprotocols": ["fcu", f"fcu.token.{pages.address.token}"],
        "additional_headers": {},
        **options,
    }
    url = f"ws://hub.example{path}"
    to_server = socket.create_connection(("127.0.0.1", pages.address.port), 30)
    try:
        with connect(url, sock=to_server, **options):
            return 0
    except InvalidStatus as refused:
        return refused.response.status_code


# -- options ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "prefix"),
    [
        ("/", "/"),
        ("/fcu", "/fcu/"),
        (BASE, BASE),
        ("/user/ada%40uni/lab-1/fcu/", "/user/ada%40uni/lab-1/fcu/"),
        ("/user/ada@uni/.x", "/user/ada@uni/.x/"),
    ],
)
def test_base_path_ends_with_slash(text: str, prefix: str) -> None:
    assert checked_base_path(text) == prefix


@pytest.mark.parametrize(
    "bad",
    ["", "fcu", "//evil.example/", "/a//b/", "/../", "/a/./b", "/a/..", "/a?b", "/a#b", "/a\\b", "/a b", "/a\n",
     "/%zz/", "/é/", "/a;b/", "https://hub.example/", "/" + "a" * 1000],
)  # fmt: skip
def test_base_path_must_be_normal(bad: str) -> None:
    with pytest.raises(InputError, match="--base-path ") as refused:
        checked_base_path(bad)
    assert refused.value.kind == "base_path"
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("text", "origin"),
    [
        (HUB, HUB),
        ("https://Hub.Example/", HUB),
        ("HTTPS://hub.example:443", HUB),
        ("http://127.0.0.1:8000", "http://127.0.0.1:8000"),
        ("http://[2001:db8::1]:8000", "http://[2001:db8::1]:8000"),
        ("http://[2001:db8::1]", "http://[2001:db8::1]"),
    ],
)
def test_behind_option_becomes_origin_in_browser_form(text: str, origin: str) -> None:
    assert checked_behind(text) == origin


@pytest.mark.parametrize(
    "bad",
    ["", "*", "hub.example", "https://", "https://*", "https://*.example", "ftp://hub.example", "null",
     "https://hub.example/user", "https://ada@hub.example", "https://hub.example?x", "https://hub.example#x",
     "https://hub.example:x", "https://hub.example:99999", "https://hub.example\n", "https://a b", "https://h,b",
     "https://[::1", "https://é.example", "https://" + "a" * 1000],
)  # fmt: skip
def test_behind_option_must_be_one_origin(bad: str) -> None:
    with pytest.raises(InputError, match="--behind ") as refused:
        checked_behind(bad)
    assert refused.value.kind == "behind"
    assert "\n" not in str(refused.value)


def test_token_is_taken_out_of_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FCU_WEB_TOKEN", TOKEN)
    assert (given_token(), given_token()) == (TOKEN, None)
    for bad in ("", "short", "t" * 101, "t" * 31 + ",", "t" * 32 + "\n"):
        monkeypatch.setenv("FCU_WEB_TOKEN", bad)
        with pytest.raises(InputError, match="FCU_WEB_TOKEN") as refused:
            given_token()
        assert refused.value.kind == "token"


# -- requests -----------------------------------------------------------------------------------------------


def test_address_is_public_address(behind: PageServer, below: PageServer) -> None:
    assert behind.url == f"{HUB}{BASE}#token={TOKEN}"
    assert behind.address.socket == f"wss://hub.example{BASE}session"
    port = below.address.port
    assert below.url == f"http://127.0.0.1:{port}{BASE}#token={below.address.token}"
    assert get(below, BASE, f"127.0.0.1:{port}").status == 200


def test_page_files_are_below_prefix_only(behind: PageServer) -> None:
    for name in ("", "app.js", "app.css", "icon.svg"):
        assert get(behind, BASE + name).status == 200
        assert get(behind, f"/{name}").status == 404
    policy = get(behind, BASE).headers["Content-Security-Policy"]
    assert "connect-src 'self' wss://hub.example;" in policy
    page = get(behind, BASE).read().decode()
    assert re.findall(r'(?:href|src)="([^"]*)"', page) == ["icon.svg", "app.css", "app.js"]


def test_prefix_without_slash_is_redirected(behind: PageServer) -> None:
    answer = get(behind, "/user/ada/fcu")
    assert (answer.status, answer.headers["Location"]) == (308, BASE)


@pytest.mark.parametrize(
    "path",
    ["/session", "/user/ada/fcusession", "/user/ada/fcu/../fcu/session", "/user/bob/fcu/session", "//user/ada/fcu/session",
     "/user/ada/fcu//session", "/user/ada/fcu/x/session", "/user/ada/fcu/session/", "/user/ada%2Ffcu/session",
     "/USER/ada/fcu/session", "/hub/user/ada/fcu/session", "/user/ada/fcu/%73ession", "http://hub.example/user/ada/fcu/session"],
)  # fmt: skip
def test_prefix_in_other_spelling_opens_no_socket(behind: PageServer, path: str) -> None:
    assert refusal(behind, f"{BASE}session") == 0
    answer = get(
        behind,
        path,
        Origin=HUB,
        Upgrade="websocket",
        Connection="Upgrade",
        **{
            "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Protocol": f"fcu, fcu.token.{TOKEN}",
        },
    )
    assert answer.status == 404


@pytest.mark.parametrize(
    "host",
    ["evil.example", "hub.example:443", "hub.example:80", "hub.example.evil.example", "xhub.example", "127.0.0.1",
     "127.0.0.1:{port}", "localhost:{port}", "hub.example, evil.example", ""],
)  # fmt: skip
def test_only_named_host_is_accepted(behind: PageServer, host: str) -> None:
    assert get(behind, BASE, host.format(port=behind.address.port)).status == 403
    forwarded = {"X-Forwarded-Host": "hub.example", "Forwarded": "host=hub.example"}
    assert get(behind, BASE, host.format(port=behind.address.port), **forwarded).status == 403


@pytest.mark.parametrize(
    "origin",
    ["http://hub.example", "https://hub.example:444", "https://evil.example", "https://hub.example.evil.example",
     "null", "http://127.0.0.1:{port}"],
)  # fmt: skip
def test_only_named_origin_opens_socket(behind: PageServer, origin: str) -> None:
    assert refusal(behind, f"{BASE}session", origin=origin.format(port=behind.address.port)) == 403


def test_socket_behind_proxy_needs_token(behind: PageServer) -> None:
    for protocols in (["fcu"], ["fcu", "fcu.token." + "u" * 32], ["fcu", TOKEN]):
        assert refusal(behind, f"{BASE}session", subprotocols=protocols) == 403
    assert refusal(behind, f"{BASE}session?token={TOKEN}", subprotocols=["fcu"]) == 403


def test_given_token_is_not_stored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    PageServer(token=TOKEN).close()
    assert not [file for file in tmp_path.rglob("*") if file.is_file() and TOKEN in file.read_text()]


# -- command and tile ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [None, TOKEN])
def test_command_prints_only_its_own_token(given: str | None, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "fcu_emulator", "web", "--no-browser", "--duration", "10ms"]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)}
    if given is not None:
        environment["FCU_WEB_TOKEN"] = given
    done = subprocess.run(
        [*command, "--base-path", BASE, "--behind", HUB],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert f"page: {HUB}{BASE}" in done.stderr
    assert ("token" in done.stderr) == (given is None)


def test_tile_keeps_token_off_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FCU_WEB_BEHIND", raising=False)
    monkeypatch.setenv("JUPYTERHUB_PUBLIC_URL", "https://hub.example/user/ada/")
    tile, other = jupyter.live_board(), jupyter.live_board()
    token = tile["environment"]["FCU_WEB_TOKEN"]
    assert token != other["environment"]["FCU_WEB_TOKEN"]
    assert tile["launcher_entry"]["path_info"] == f"fcu/#token={token}"
    assert token not in " ".join(tile["command"])
    assert tile["command"][-2:] == ["--behind", HUB]
    assert tile["request_headers_override"] == {}
    assert Path(tile["launcher_entry"]["icon_path"]).is_file()


@pytest.mark.parametrize("public", ["", "nothing", "https://*/", "javascript:x"])
def test_tile_without_public_address_lets_jupyter_check_host(
    public: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FCU_WEB_BEHIND", raising=False)
    monkeypatch.setenv("JUPYTERHUB_PUBLIC_URL", public)
    tile = jupyter.live_board()
    assert "--behind" not in tile["command"]
    assert tile["request_headers_override"]["Host"] == "127.0.0.1:{port}"


def test_wrong_origin_of_operator_is_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FCU_WEB_BEHIND", "hub.example")
    with pytest.raises(InputError, match="--behind "):
        jupyter.live_board()
