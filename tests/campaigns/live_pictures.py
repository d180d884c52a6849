"""Screenshots of the page for docs/web.md: ``python -m tests.campaigns.live_pictures``."""

from __future__ import annotations

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

from fcu_emulator.emulator.cli.exercises import LabExercises
from fcu_emulator.emulator.live.setup import Setup
from tests.integration.test_live_page import ARGUMENTS, Served

DOCS = Path(__file__).parents[2] / "docs"


def main() -> None:
    """Play a scenario, and take both pictures at its end."""
    served = Served(Setup("solution", "led_x"), exercises=LabExercises())
    try:
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
            for theme, pane, end_s in (("light", "scenario", 5.6), ("dark", "registers", 9.3)):
                context = browser.new_context(
                    bypass_csp=True, viewport={"width": 1280, "height": 720}, color_scheme=theme
                )
                context.add_init_script("localStorage.setItem('fcu-tour', 'taken')")
                page = context.new_page()
                page.goto(served.pages.url)
                page.click(f"#tab-{pane}")
                page.wait_for_function(
                    f"parseFloat(document.querySelector('#time').textContent) > {end_s}", polling=50
                )
                page.click("#runner")
                page.wait_for_function("document.body.dataset.state === 'paused'")
                page.screenshot(path=DOCS / f"web-{theme}.png")
                page.click("#runner")
                context.close()
            browser.close()
    finally:
        served.close()


if __name__ == "__main__":
    main()
