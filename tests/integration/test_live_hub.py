"""Two users with a board each in a real JupyterHub, and attempts to reach the board of the other user.

The tests are skipped without jupyterhub, jupyterlab, jupyter-server-proxy, configurable-http-proxy and Chromium:
``pip install jupyterhub jupyterlab jupyter-server-proxy`` and ``npm install -g configurable-http-proxy``.
"""

from __future__ import annotations

import http.client
import json
import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from tests.support.jupyter_hub import Hub, board_port, processes

for needed in ("jupyterhub", "jupyterlab", "jupyter_server_proxy"):
    pytest.importorskip(needed)
playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform != "linux", reason="the test reads /proc"),
    pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed"),
    pytest.mark.skipif(
        shutil.which("configurable-http-proxy") is None, reason="configurable-http-proxy is not installed"
    ),
]


class User:
    """A user of the hub with a browser, and an open page of the live board."""

    def __init__(self, hub: Hub, browser: playwright.Browser, name: str) -> None:
        self.hub = hub
        self.name = name
        self.addresses: list[str] = []
        self.context = browser.new_context(viewport={"width": 1280, "height": 800})
        self.context.add_init_script("localStorage.setItem('fcu-tour', 'taken')")
        self.context.on("request", lambda request: self.addresses.append(request.url))
        self.lab = self.context.new_page()
        self.lab.set_default_timeout(120_000)
        self.lab.goto(f"{hub.origin}/hub/login?next=/hub/spawn")
        self.lab.fill("input[name=username]", name)
        self.lab.fill("input[name=password]", "any")
        self.lab.click("#login_submit")
        self.lab.wait_for_url(f"**/user/{name}/lab**")
        self.tile = self.lab.locator(".jp-LauncherCard", has_text="FCU board").first
        self.tile.wait_for()
        with self.context.expect_page() as opened:
            self.tile.click()
        self.board = opened.value
        self.board.set_default_timeout(120_000)
        self.board.wait_for_selector("body[data-state]")

    @property
    def base(self) -> str:
        return f"/user/{self.name}/fcu/"

    @property
    def token(self) -> str:
        stored: str = self.board.evaluate(
            "Object.entries(sessionStorage).find(([k]) => k.startsWith('fcu-token'))[1]"
        )
        return stored

    def cookie(self, path: str) -> str:
        """Return the cookies that the browser sends to ``path``."""
        cookies = self.context.cookies(self.hub.origin + path)
        return "; ".join(f"{one['name']}={one['value']}" for one in cookies)


@pytest.fixture(scope="module", params=[True, False], ids=["public address known", "unknown"])
def hub(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hub]:
    one = Hub(tmp_path_factory.mktemp("hub"), request.param)
    yield one
    one.close()


@pytest.fixture(scope="module")
def users(hub: Hub) -> Iterator[tuple[User, User]]:
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"])
        yield User(hub, browser, "ada"), User(hub, browser, "bob")
        browser.close()


def get(hub: Hub, path: str, cookie: str = "", port: int | None = None) -> tuple[int, str]:
    """Return status and body for the hub's address, or for a port with the Host header of the hub."""
    place = urlsplit(hub.origin)
    with closing(http.client.HTTPConnection("127.0.0.1", port or place.port, timeout=60)) as connection:
        connection.request("GET", path, headers={"Host": place.netloc, "Cookie": cookie})
        with connection.getresponse() as answer:
            return answer.status, answer.read().decode(errors="replace")


def first_event(hub: Hub, path: str, cookie: str, token: str, origin: str | None = None) -> str:
    """Return the type of the first event of a socket, or "" if the socket is refused or closed."""
    place = urlsplit(hub.origin)
    try:
        with connect(
            f"ws://{place.netloc}{path}",
            origin=origin or hub.origin,  # type: ignore[arg-type]
            subprotocols=["fcu", f"fcu.token.{token}"],  # type: ignore[list-item]
            additional_headers={"Cookie": cookie},
            open_timeout=60,
        ) as client:
            kind: str = json.loads(client.recv(timeout=60))["type"]
            return kind
    except (InvalidStatus, ConnectionClosed):
        return ""


def test_two_users_have_two_running_boards(users: tuple[User, User]) -> None:
    ada, bob = users
    for user in users:
        assert user.board.url == f"{user.hub.origin}{user.base}"
        user.board.wait_for_selector("body[data-state=running]")
    ada.board.click("text=Pause")
    ada.board.wait_for_selector("body[data-state=paused]")
    assert bob.board.evaluate("document.body.dataset.state") == "running"
    assert board_port("ada") != board_port("bob")
    ada.board.reload()
    ada.board.wait_for_selector("body[data-state=paused]")


def test_owner_reaches_own_board(users: tuple[User, User]) -> None:
    for user in users:
        path = f"{user.base}session"
        assert first_event(user.hub, path, user.cookie(path), user.token) != ""


def test_other_user_gets_neither_page_nor_tile(users: tuple[User, User]) -> None:
    ada, bob = users
    for path in (ada.base, f"{ada.base}app.js", "/user/ada/server-proxy/servers-info"):
        for cookie in (bob.cookie(path), bob.cookie(bob.base), ""):
            status, body = get(ada.hub, path, cookie)
            assert status in (302, 403)
            assert ada.token not in body
            assert "app.js" not in body


def test_token_of_other_user_opens_no_socket(users: tuple[User, User]) -> None:
    ada, bob = users
    path = f"{ada.base}session"
    assert first_event(ada.hub, path, bob.cookie(path), ada.token) == ""  # with a stolen token, as bob
    assert first_event(ada.hub, path, bob.cookie(bob.base), ada.token) == ""
    assert first_event(ada.hub, path, "", ada.token) == ""
    assert first_event(ada.hub, path, ada.cookie(path), bob.token) == ""
    assert first_event(ada.hub, path, ada.cookie(path), "") == ""


@pytest.mark.parametrize(
    "origin", ["https://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1"]
)
def test_page_of_other_origin_opens_no_socket(users: tuple[User, User], origin: str) -> None:
    ada, _ = users
    path = f"{ada.base}session"
    assert first_event(ada.hub, path, ada.cookie(path), ada.token, origin) == ""


def test_proxy_of_other_user_opens_no_socket(users: tuple[User, User]) -> None:
    ada, bob = users
    port = board_port(
        "ada"
    )  # both boards are on 127.0.0.1 of one machine, and the proxy of Jupyter reaches each port
    for path in (
        f"/user/bob/proxy/{port}/session",
        f"/user/bob/proxy/{port}/user/ada/fcu/session",
        f"/user/bob/proxy/absolute/{port}/session",
        f"/user/bob/proxy/absolute/{port}/user/ada/fcu/session",
        "/user/bob/fcu/../../ada/fcu/session",
        "/user/bob/fcu/..%2f..%2fada/fcu/session",
    ):
        assert first_event(ada.hub, path, bob.cookie(path), bob.token) == ""
        assert ada.token not in get(ada.hub, path.removesuffix("session"), bob.cookie(path))[1]


def test_port_itself_opens_no_socket_without_token(users: tuple[User, User]) -> None:
    ada, _ = users
    port = board_port("ada")
    for host in (f"127.0.0.1:{port}", urlsplit(ada.hub.origin).netloc):
        with (
            pytest.raises(InvalidStatus) as refused,
            connect(
                f"ws://127.0.0.1:{port}{ada.base}session",
                additional_headers={},
                origin=f"http://{host}",  # type: ignore[arg-type]
                subprotocols=["fcu", "fcu.token.x"],  # type: ignore[list-item]
            ),
        ):
            pass
        assert refused.value.response.status_code == 403
    assert get(ada.hub, "/", port=port)[0] in (403, 404)


def test_token_is_in_no_request_log_or_command(users: tuple[User, User], hub: Hub) -> None:
    logged = hub.log()
    assert "/user/ada/fcu/" in logged
    for user in users:
        assert user.base in " ".join(user.addresses)
        sent = [address.partition("#")[0] for address in user.addresses]
        assert not [address for address in sent if user.token in address]
        assert user.token not in logged
        assert not [line for _, line in processes("--base-path") if user.token in line]
        assert user.token not in user.board.url
        assert user.token not in user.cookie(user.base)


def test_bookmark_without_token_shows_remedy(users: tuple[User, User]) -> None:
    ada, _ = users
    page = ada.context.new_page()
    page.goto(f"{ada.hub.origin}{ada.base.removesuffix('/')}")
    page.wait_for_selector("text=refused: open the launcher's tile")
    assert page.url == f"{ada.hub.origin}{ada.base}"
    page.close()


def test_page_in_hub_can_be_photographed(users: tuple[User, User], tmp_path: Path) -> None:
    folder = Path(os.environ.get("FCU_PICTURES", tmp_path))
    ada, _ = users
    ada.lab.screenshot(path=folder / "launcher.png")
    ada.board.screenshot(path=folder / "board.png")
    assert (folder / "board.png").stat().st_size > 10_000
