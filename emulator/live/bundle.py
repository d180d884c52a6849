"""The page's files, compressed once for browsers that accept gzip."""

from __future__ import annotations

import gzip
from dataclasses import dataclass
from importlib.resources import files

_FILES = {
    "/": ("index.html", "text/html; charset=utf-8"),
    "/app.js": ("app.js", "text/javascript; charset=utf-8"),
    "/app.css": ("app.css", "text/css; charset=utf-8"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}


@dataclass(frozen=True)
class PageFile:
    """Headers and body of a file's HTTP response."""

    headers: tuple[tuple[str, str], ...]
    body: bytes


class Bundle:
    """All page files. Raises OSError if they cannot be read."""

    def __init__(self) -> None:
        page = files("fcu_emulator.emulator.live").joinpath("page")
        self._plain: dict[str, PageFile] = {}
        self._compressed: dict[str, PageFile] = {}
        for path, (name, kind) in _FILES.items():
            body = page.joinpath(name).read_bytes()
            headers = (("Content-Type", kind), ("Vary", "Accept-Encoding"))
            self._plain[path] = PageFile(headers, body)
            small = gzip.compress(body, mtime=0)
            if len(small) < len(body):
                self._compressed[path] = PageFile((*headers, ("Content-Encoding", "gzip")), small)

    def file(self, path: str, accepted: list[str]) -> PageFile | None:
        if accepts_gzip(accepted) and path in self._compressed:
            return self._compressed[path]
        return self._plain.get(path)


def accepts_gzip(headers: list[str]) -> bool:
    """Return whether Accept-Encoding headers allow gzip (RFC 9110, 12.5.3)."""
    weights: dict[str, float] = {}
    for coding in ",".join(headers).split(","):
        name, _, parameter = coding.partition(";")
        key, _, value = parameter.strip().partition("=")
        try:
            weight = float(value) if key.strip().lower() == "q" else 1.0
        except ValueError:
            weight = 0.0
        weights[name.strip().lower()] = weight
    return weights.get("gzip", weights.get("*", 0.0)) > 0
