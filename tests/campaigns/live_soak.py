"""A long session at real time with Chromium attached: ``python -m tests.campaigns.live_soak --minutes 60``.

Every minute it prints the resident memory of the server and the heap of the page after a garbage collection.
Meanwhile the board is turned sometimes, and the panes are opened one after the other. The page keeps ten minutes of
states and 20,000 lines of the terminal, so its heap grows until these are full. The exit code is 1 if, since the
fifth minute, the server has grown by more than 20 MB, or the page by more than 40 MB.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

from playwright.sync_api import CDPSession, Page, sync_playwright

from tests.integration.test_live_page import ARGUMENTS

MB = 1_000_000
PANES = ("world", "registers", "bus", "pins", "scenario", "diagnosis")
SETTLED_MIN = 5
MOST_SERVER_MB, MOST_PAGE_MB = 20, 40


class Memory(NamedTuple):
    """Memory in MB after a number of minutes."""

    minutes: int
    server: float
    page: float
    virtual_s: float


def main() -> int:
    """Run the session, and print a line each minute."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--minutes", type=int, default=60)
    parser.add_argument("--firmware", default="solution")
    options = parser.parse_args()
    program = [sys.executable, "-m", "fcu_emulator", "web", options.firmware, "--no-browser"]
    with subprocess.Popen(program, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        try:
            url = next(found[0] for line in server.stderr if (found := re.search(r"http\S+", line)))
            seen = soak(url, server.pid, options.minutes)
        finally:
            server.terminate()
    settled = [one for one in seen if one.minutes >= min(SETTLED_MIN, options.minutes)]
    server_mb, page_mb = (settled[-1][index] - settled[0][index] for index in (1, 2))
    print(f"since minute {settled[0].minutes}: server {server_mb:+.1f} MB, page {page_mb:+.1f} MB")  # noqa: T201
    return int(server_mb > MOST_SERVER_MB or page_mb > MOST_PAGE_MB)


def soak(url: str, pid: int, minutes: int) -> list[Memory]:
    """Yield the memory at the start and after each minute."""
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        context = browser.new_context(bypass_csp=True, viewport={"width": 1280, "height": 720})
        context.add_init_script("localStorage.setItem('fcu-tour', 'taken')")
        page = context.new_page()
        page.set_default_timeout(120_000)
        page.goto(url.replace("/#", "/?2d#"))
        page.wait_for_selector("body[data-ready=true]")
        inspector = context.new_cdp_session(page)
        inspector.send("Performance.enable")
        began_s, seen = time.monotonic(), []
        for minute in range(minutes + 1):
            page.click(f"#tab-{PANES[minute % len(PANES)]}")
            page.fill("#slide-pitch", str(minute * 7 % 90))
            left_s = began_s + 60 * minute - time.monotonic()
            if left_s > 0:
                page.wait_for_timeout(1000 * left_s)
            seen.append(measured(minute, pid, page, inspector))
            print("{} min: server {:.1f} MB, page {:.1f} MB, {:.0f} s virtual".format(*seen[-1]), flush=True)  # noqa: T201
        browser.close()
    return seen


def measured(minute: int, pid: int, page: Page, inspector: CDPSession) -> Memory:
    """Return the present memory, after the page's garbage collection."""
    inspector.send("HeapWiringr.collectGarbage")
    figures = {one["name"]: one["value"] for one in inspector.send("Performance.getMetrics")["metrics"]}
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    resident = re.search(r"VmRSS:\s+(\d+) kB", status)
    assert resident is not None
    virtual_s = float((page.text_content("#time") or "0").split()[0])
    return Memory(minute, int(resident[1]) * 1024 / MB, figures["JSHeapUsedSize"] / MB, virtual_s)


if __name__ == "__main__":
    sys.exit(main())
