"""The page's layout and accessibility: no element exceeds the window at any width, and axe-core has no findings.

axe-core comes from ``web/node_modules``, which ``.ci/page`` installs (``cd web && npm ci``). Without axe-core,
its tests are skipped.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.cli.exercises import LabExercises
from fcu_emulator.emulator.live.setup import Setup
from tests.integration import test_live_page as live
from tests.support.arm.broken_programs import FOLDER

chromium, browser = live.chromium, live.browser
pytestmark = live.pytestmark

PANES = ("world", "registers", "bus", "pins", "scenario", "diagnosis")
WIDTHS = (360, 414, 768, 1024, 1280, 1440, 1536, 1920)
AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
STICKS_OUT = """() => [...document.querySelectorAll('body *')]
    .filter(one => !one.closest('.xterm, .uplot, .pane, canvas') && one.checkVisibility())
    .filter(one => one.getBoundingClientRect().right > innerWidth + 0.5)
    .map(one => one.outerHTML.slice(0, 80))"""


@pytest.fixture(scope="module")
def healthy() -> Iterator[live.Served]:
    one = live.Served(Setup("solution", ideal=True), exercises=LabExercises())
    yield one
    one.close()


@pytest.fixture(scope="module")
def crashed() -> Iterator[live.Served]:
    one = live.Served(Setup(FOLDER / "outside_memory.elf"), exercises=LabExercises())
    yield one
    one.close()


def at_rest(page: Any) -> Any:
    """Return the page of a paused board, so that nothing is drawn during the test."""
    if page.text_content("#runner") == "Pause":
        page.click("#runner")
    live.until(page, "document.body.dataset.state === 'paused'")
    return page


def with_findings(browser: live.Browser, crashed: live.Served, **more: Any) -> Any:
    page = browser.open(crashed, **more)
    live.until(page, "document.querySelector('#tab-diagnosis .badge:not([hidden])')")
    return at_rest(page)


def each_pane(page: Any) -> Iterator[str]:
    for pane in PANES:
        page.click(f"#tab-{pane}")
        live.until(page, f"!document.querySelector('#pane-{pane}').hidden")
        yield pane


def assert_fits(page: Any) -> None:
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 800})
        for pane in each_pane(page):
            assert page.evaluate("document.documentElement.scrollWidth") <= width, (width, pane)
            assert page.evaluate(STICKS_OUT) == [], (width, pane)


def test_page_without_findings_fits_every_width(browser: live.Browser, healthy: live.Served) -> None:
    assert_fits(at_rest(browser.open(healthy)))


def test_page_with_findings_fits_every_width(browser: live.Browser, crashed: live.Served) -> None:
    assert_fits(with_findings(browser, crashed))


def test_tour_fits_every_width(browser: live.Browser, healthy: live.Served) -> None:
    page = at_rest(browser.open(healthy))
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 800})
        page.click("#help")
        page.click("#tour-again")
        stops = 0
        while page.is_visible("#tour"):
            box = page.locator("#tour").bounding_box()
            assert 0 <= box["x"] <= box["x"] + box["width"] <= width
            assert 0 <= box["y"] <= box["y"] + box["height"] <= 800
            page.click("#tour-next")
            stops += 1
        assert stops == 6


# -- accessibility ------------------------------------------------------------------------------------------


def violations(page: Any) -> list[str]:
    """Return axe-core's findings, with its experimental rules: rule, element, reason."""
    rules = {"label-content-name-mismatch": {"enabled": True}, "target-size": {"enabled": True}}
    found = page.evaluate("rules => axe.run(document, { rules })", rules)["violations"]
    return [
        f"{one['id']}: {node['html'][:100]}: {node['failureSummary']}"
        for one in found
        for node in one["nodes"]
    ]


@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: cd web && npm ci")
@pytest.mark.parametrize("width", [360, 1280])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_core_reports_no_accessibility_violations(
    theme: str, width: int, browser: live.Browser, healthy: live.Served, crashed: live.Served
) -> None:
    found: dict[str, list[str]] = {}
    for name, page in (
        ("healthy", at_rest(browser.open(healthy, theme=theme))),
        ("crashed", with_findings(browser, crashed, theme=theme)),
    ):
        page.set_viewport_size({"width": width, "height": 800})
        page.add_script_tag(path=AXE)
        page.click("[data-subject=variables]")
        for pane in each_pane(page):
            found[f"{name} {pane}"] = violations(page)
    page.click("#help")
    found["keys"] = violations(page)
    page.click("#tour-again")
    found["tour"] = violations(page)
    assert sorted({line for one in found.values() for line in one}) == []
