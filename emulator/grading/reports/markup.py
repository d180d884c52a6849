"""HTML and SVG that are safe from injection: every text that is not :class:`Html` is escaped.

::

    element("td", student.name, class_="name")

Each page's content security policy also forbids scripts and requests.

Decision: a few functions write the markup. A template library was rejected, because in a template a
setting, and not the type, decides whether text is escaped.
"""

from __future__ import annotations

import base64
import hashlib
import html
from collections.abc import Iterable
from typing import TypeAlias

from fcu_emulator.emulator.text import visible


class Html(str):
    """Escaped HTML, which only this module creates."""

    __slots__ = ()


Child: TypeAlias = "Html | str | int | Iterable[Child] | None"

_EMPTY = frozenset({"meta", "br", "line", "circle", "path", "polyline"})


def element(tag: str, *children: Child, **attributes: str | float | None) -> Html:
    """Return an element. Attribute ``class_`` becomes class, ``text_anchor`` becomes text-anchor."""
    given = "".join(
        f' {name.rstrip("_").replace("_", "-")}="{_text(_number(value))}"'
        for name, value in attributes.items()
        if value is not None
    )
    if tag in _EMPTY:
        return Html(f"<{tag}{given}/>")
    return Html(f"<{tag}{given}>{join(children)}</{tag}>")


def join(children: Child) -> Html:
    """Join all children. Escape children that are plain text."""
    if children is None:
        return Html("")
    if isinstance(children, Html):
        return children
    if isinstance(children, str | int):
        return Html(_text(str(children)))
    return Html("".join(join(child) for child in children))


def page(title: str, style: str, *body: Child) -> str:
    """Return a whole page with one style sheet."""
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    policy = f"default-src 'none'; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", http_equiv="Content-Security-Policy", content=policy),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("meta", name="referrer", content="no-referrer"),
        element("title", title),
        element("style", Html(style)),
    )
    return f"<!doctype html>\n{element('html', head, element('body', *body), lang='en')}\n"


def _text(text: str) -> str:
    return html.escape(visible(text, lines=True), quote=True)


def _number(value: str | float) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
