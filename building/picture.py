"""Draw the moving picture of the README: python building/picture.py

The script starts ``fcu web`` with a scenario, in slow motion, and takes screenshots of the page in Chromium. Each frame
is shown for the virtual time until the next frame, so the picture runs at the board's speed. The script writes
docs/run.webp. It needs Chromium, and Playwright and Pillow from the extra ``test``.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import Final

from PIL import Image
from playwright.sync_api import Page, ViewportSize, sync_playwright

ROOT: Final = Path(__file__).parents[1]
PICTURE: Final = ROOT / "docs" / "run.webp"
COMMAND: Final = ("web", "solution", "--scenario", "led_x", "--no-browser")
BEGIN_S: Final = 4.9
END_S: Final = 12.45
STEP_S: Final = 0.12
SIZE: Final[ViewportSize] = {"width": 1280, "height": 720}
ARGUMENTS: Final = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]


def now_s(page: Page) -> float:
    """Return the virtual time that the page shows."""
    return float(page.inner_text("#time").split()[0])


def frames(page: Page) -> list[tuple[float, Image.Image]]:
    """Play the scenario from its start, and return screenshots with their virtual times."""
    page.click("#tab-scenario")
    page.select_option("#speed", value="0.1")
    page.get_by_text("From the start").click()
    page.wait_for_function("parseFloat(document.querySelector('#time').textContent) < 1", polling=20)
    taken: list[tuple[float, Image.Image]] = []
    next_s = BEGIN_S
    while next_s < END_S:
        page.wait_for_function(
            f"parseFloat(document.querySelector('#time').textContent) >= {next_s}",
            polling=20,
            timeout=120_000,
        )
        taken.append((now_s(page), Image.open(io.BytesIO(page.screenshot())).convert("RGB")))
        next_s = taken[-1][0] + STEP_S
    return taken


def write(taken: list[tuple[float, Image.Image]]) -> None:
    """Write the frames as one animated image; the final frame is shown for a second."""
    times_s = [time_s for time_s, _ in taken]
    shown_ms = [round(1000 * (after - before)) for before, after in pairwise(times_s)]
    first, *others = (image for _, image in taken)
    first.save(
        PICTURE, save_all=True, append_images=others, duration=[*shown_ms, 1000], loop=0, quality=70, method=6
    )


def main() -> None:
    """Serve the page, record it, and write the picture."""
    served = subprocess.Popen(
        [sys.executable, "-m", "fcu_emulator", *COMMAND], cwd=ROOT, stderr=subprocess.PIPE, text=True
    )
    assert served.stderr is not None
    try:
        address = next(found[0] for line in served.stderr if (found := re.search(r"http://\S+", line)))
        with sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
            context = browser.new_context(bypass_csp=True, viewport=SIZE, color_scheme="light")
            context.add_init_script("localStorage.setItem('fcu-tour', 'taken')")
            page = context.new_page()
            page.goto(address)
            taken = frames(page)
            browser.close()
    finally:
        served.terminate()
        served.wait()
    write(taken)


if __name__ == "__main__":
    main()
