"""The page's server: compressed files, and an address for other machines."""

from __future__ import annotations

import gzip
import socket
import sys
from collections.abc import Iterator
from http.client import HTTPConnection
from importlib.resources import files

import pytest

from fcu_emulator.emulator.errors import InputError, LinkError
from fcu_emulator.emulator.live import listening
from fcu_emulator.emulator.live.bundle import Bundle, accepts_gzip
from fcu_emulator.emulator.live.server import PageServer

OTHER = "127.0.0.2"
NOT_HERE = "192.0.2.1"  # RFC 5737: for documentation


def raw(name: str) -> bytes:
    return files("fcu_emulator.emulator.live").joinpath("page", name).read_bytes()


# -- compressed files ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("headers", "accepted"),
    [
        ([], False),
        ([""], False),
        (["gzip, deflate, br"], True),
        (["deflate", "GZIP;q=0.5"], True),
        (["br;q=1, gzip;q=0"], False),
        (["*"], True),
        (["*, gzip;q=0"], False),
        (["gzip;q=x"], False),
        (["identity"], False),
    ],
)
def test_gzip_is_used_if_client_accepts_it(headers: list[str], accepted: bool) -> None:
    assert accepts_gzip(headers) == accepted
    file = Bundle().file("/app.js", headers)
    assert file is not None
    assert (("Content-Encoding", "gzip") in file.headers) == accepted
    assert (gzip.decompress(file.body) if accepted else file.body) == raw("app.js")


def test_compression_reduces_page_to_third() -> None:
    bundle = Bundle()
    plain, small = (bundle.file("/app.js", accepted) for accepted in ([], ["gzip"]))
    assert plain is not None
    assert small is not None
    assert len(small.body) < 0.34 * len(plain.body)
    assert bundle.file("/server.py", ["gzip"]) is None


def test_server_sends_gzip_to_browser() -> None:
    pages = PageServer()
    try:
        connection = HTTPConnection("127.0.0.1", pages.address.port, timeout=30)
        path = "/app.css"
        connection.request("GET", path, headers={"Accept-Encoding": "gzip, br"})
        response = connection.getresponse()
        assert (response.status, response.getheader("Content-Encoding")) == (200, "gzip")
        assert gzip.decompress(response.read()) == raw("app.css")
    finally:
        pages.close()


# -- other machines -----------------------------------------------------------------------------------------


@pytest.fixture
def other() -> Iterator[PageServer]:
    if sys.platform != "linux":
        pytest.skip("only Linux has all of 127.0.0.0/8 as addresses of this machine")
    one = PageServer(listen=OTHER)
    yield one
    one.close()


def status(pages: PageServer, host: str, at: str) -> int:
    connection = HTTPConnection(at, pages.address.port, timeout=30)
    connection.request("GET", "/app.css", headers={"Host": host})
    return connection.getresponse().status


def test_server_listens_only_on_given_address(other: PageServer) -> None:
    port = other.address.port
    assert other.url.startswith(f"http://{OTHER}:{port}/")
    assert other.address.socket.startswith(f"ws://{OTHER}:{port}/")
    assert status(other, f"{OTHER}:{port}", OTHER) == 200
    with pytest.raises(ConnectionRefusedError), socket.create_connection(("127.0.0.1", port), 30):
        pass


def test_other_host_names_are_refused(other: PageServer) -> None:
    for host in ("127.0.0.1", "localhost", "evil.example"):
        assert status(other, f"{host}:{other.address.port}", OTHER) == 403
    assert status(other, OTHER, OTHER) == 403


@pytest.mark.parametrize("bad", ["", "0.0.0.0", "::", "mylaptop", "192.168.1", "224.0.0.1", "fe80::1"])
def test_listen_option_must_be_one_address(bad: str) -> None:
    with pytest.raises(InputError, match="--listen ") as refused:
        PageServer(listen=bad)
    assert refused.value.kind == "address"


def test_listening_on_address_of_another_machine_is_refused() -> None:
    with pytest.raises(LinkError, match=NOT_HERE):
        PageServer(listen=NOT_HERE)


def test_warning_appears_if_other_machines_reach_page() -> None:
    assert listening.warning("127.0.0.1") == listening.warning(OTHER) == listening.warning("::1") == ""
    assert "\n" not in listening.warning("192.168.1.20")
    assert "192.168.1.20" in listening.warning("192.168.1.20")


def test_ipv6_address_is_in_brackets_in_urls() -> None:
    assert listening.hosts("2001:db8::1", 80) == ("[2001:db8::1]:80",)
    assert listening.checked("2001:0DB8::0001") == "2001:db8::1"
