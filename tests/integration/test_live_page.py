"""The page in a real browser: actions of a student, and their visible results.

The tests are skipped without Chromium; `.ci/run` installs Debian's. They do not test frame rates, because the browser
draws in software.
"""

from __future__ import annotations

import re
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from fcu_emulator.emulator.live.exercises import Exercises
from fcu_emulator.emulator.live.server import PageServer
from fcu_emulator.emulator.live.session import LiveSession
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.emulator.python_cpu.hal import HAL_OK, VirtualHal
from fcu_emulator.firmware_model.arm import prebuilt
from tests.support.live_fakes import ButtonReader, Reader
from tests.support.recipe import GreenhouseBoard

playwright = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
ARGUMENTS = [
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-component-update",
]


class Served:
    """A session and the server of its page, which can be restarted."""

    def __init__(self, setup: Setup, port: int = 0, exercises: Exercises | None = None) -> None:
        self.pages = PageServer(port)
        self._exercises = exercises
        self.ready = threading.Event()
        self.session: LiveSession
        self._thread = threading.Thread(target=self._live, args=(setup,))
        self._thread.start()
        assert self.ready.wait(30)

    def close(self) -> None:
        self.session.stop()
        self._thread.join()
        self.pages.close()

    def _live(self, setup: Setup) -> None:
        self.session = LiveSession(setup, self.pages.publish, exercises=self._exercises)
        self.pages.controls = self.session
        self.ready.set()
        self.session.run()


@pytest.fixture(scope="module")
def chromium() -> Iterator[playwright.Browser]:
    with playwright.sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield started
        started.close()


class Browser:
    """A browser that opens pages, by default without WebGL, which is slow in software."""

    def __init__(self, chromium: playwright.Browser) -> None:
        self._chromium = chromium
        self._contexts: list[playwright.BrowserContext] = []
        self.errors: list[str] = []

    def open(
        self, served: Served, *, in_space: bool = False, first_visit: bool = False, theme: str = "light"
    ) -> playwright.Page:
        """Open a page that shows the board. The user has taken the tour, except with ``first_visit``."""
        context = self._chromium.new_context(
            bypass_csp=True, viewport={"width": 1280, "height": 720}, color_scheme=theme
        )
        self._contexts.append(context)
        if not first_visit:
            context.add_init_script("localStorage.setItem('fcu-tour', 'taken')")
        page = context.new_page()
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.set_default_timeout(30_000)
        page.goto(served.pages.url.replace("/#", "/#" if in_space else "/?2d#"))
        until(page, "document.body.dataset.state && document.querySelector('#time')?.textContent.length > 2")
        return page

    def close(self) -> None:
        for context in self._contexts:
            context.close()


@pytest.fixture
def browser(chromium: playwright.Browser) -> Iterator[Browser]:
    one = Browser(chromium)
    yield one
    one.close()
    assert one.errors == []


@pytest.fixture
def served() -> Iterator[Served]:
    one = Served(Setup("solution", ideal=True))
    yield one
    one.close()


def until(page: playwright.Page, condition: str) -> None:
    page.wait_for_function(condition, polling=50)


def test_dragging_turns_board_and_lights_led(browser: Browser, served: Served) -> None:
    page = browser.open(served, in_space=True)
    box = page.locator(".board-view").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y + 80, steps=10)
    page.mouse.move(x, y + 196, steps=10)  # 0.45 degrees a pixel: 88 degrees about the board's X
    page.mouse.up()
    until(page, "Math.abs(Number(document.querySelector('#num-attitude-roll').textContent) - 88.2) < 0.2")
    until(page, "document.querySelector('[data-led=LED2]').dataset.on === 'true'")
    assert page.get_attribute("[data-led=LED1]", "data-on") == "false"
    page.click("text=Flat")
    until(page, "document.querySelector('[data-led=LED2]').dataset.on === 'false'")
    page.focus(".board-view")
    for _ in range(17):
        page.keyboard.press("ArrowRight")
    until(page, "document.querySelector('[data-led=LED1]').dataset.on === 'true'")
    until(page, "Number(document.querySelector('#num-attitude-pitch').textContent) === 85")


def test_magnet_can_be_held_and_dragged_and_removed(browser: Browser, served: Served) -> None:
    page = browser.open(served, in_space=True)
    field = "Number(document.querySelector('#num-mag-{}').textContent)"
    until(page, f"{field.format('x')} === 215 && {field.format('y')} === 0")
    page.click("#magnet")  # 0.2 m to the north, pointing west: -m / r^3 = -37.5 mgauss there
    until(page, f"{field.format('x')} === 215 && Math.abs({field.format('y')} + 37.5) <= 0.5")
    box = page.locator(".board-view").bounding_box()
    places = ((box["x"] + box["width"] * part / 20, box["y"] + box["height"] / 2) for part in range(10, 20))
    for x, y in places:  # it is drawn somewhere at the right
        page.mouse.move(x, y)
        if page.locator(".board-view.on-magnet").count():
            break
    page.mouse.down()
    page.mouse.move(x, y - 30, steps=5)
    page.mouse.up()
    until(page, "/^\\d+N \\d+W 0 cm$/.test(document.querySelector('#magnet-place').textContent)")
    assert page.text_content("#num-attitude-roll") == "0.0"  # the board was not dragged
    page.focus("#magnet")
    for _ in range(3):
        page.keyboard.press("PageUp")
    until(page, "document.querySelector('#magnet-place').textContent.endsWith('W 3 cm')")
    page.click("#magnet")
    until(page, f"{field.format('x')} === 215 && {field.format('y')} === 0")
    assert page.text_content("#magnet-place") == ""


def test_page_without_webgl_shows_horizon(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    assert page.evaluate("document.querySelector('.board-view').getContext('2d') !== null")


def test_typed_text_reaches_board_and_recording(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    until(page, "document.querySelector('.xterm-rows').textContent.includes('Pitch:')")
    page.click(".screen")
    page.keyboard.type("p")
    page.fill("[placeholder^='Send hex']", "00 ff 0d")
    page.press("[placeholder^='Send hex']", "Enter")
    with page.expect_download() as download:
        page.click("#record")
    text = Path(download.value.path()).read_text(encoding="utf-8")
    assert re.findall(r'hex = "([^"]*)"', text) == ["70", "00 ff 0d"]


class Echo:
    """Firmware that sends each received byte back in hexadecimal."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        while True:
            status, data = self._hal.HAL_UART_Receive(1, 1000)
            if status == HAL_OK:
                self._hal.HAL_UART_Transmit(f"<{data.hex()}>".encode(), 1000)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""


def test_typed_text_is_echoed_bytewise(browser: Browser) -> None:
    served = Served(Setup(Echo))
    try:
        page = browser.open(served)
        page.click(".screen")
        page.keyboard.press("a")
        until(page, "document.querySelector('.xterm-rows').textContent.includes('<61>')")
        page.keyboard.press("Enter")
        until(page, "document.querySelector('.xterm-rows').textContent.includes('<0d>')")
        page.fill("[placeholder^='Send hex']", "ff")
        page.press("[placeholder^='Send hex']", "Enter")
        until(page, "document.querySelector('.xterm-rows').textContent.includes('<ff>')")
    finally:
        served.close()


def test_plot_shows_truth_and_printed_values(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.fill("#slide-pitch", "40")
    until(page, "document.querySelector('#num-attitude-pitch').textContent === '40.0'")
    near = r"/Pitch: (39\.[5-9]|40\.[0-4])[^]*Altitude: [^]*m/"
    until(page, f"{near}.test(document.querySelector('.xterm-rows').textContent)")
    with page.expect_download() as download:
        page.click("text=CSV")
    header, *rows = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
    names = header.replace('"', "").split(",")
    table = [dict(zip(names, row.split(","), strict=True)) for row in rows]
    truth = [float(row["Pitch truth (deg)"]) for row in table if row["Pitch truth (deg)"]]
    printed = [float(row["Pitch printed (deg)"]) for row in table if row["Pitch printed (deg)"]]
    assert truth[-1] == pytest.approx(40, abs=0.05)
    assert printed[-1] == pytest.approx(40, abs=0.5)
    page.click("[data-subject=variables]")
    page.fill("[placeholder='Add a variable']", "pitch")
    page.press("[placeholder='Add a variable']", "Enter")
    until(
        page, "[...document.querySelectorAll('.u-legend th')].some(one => one.textContent.includes('pitch'))"
    )
    with page.expect_download() as picture:
        page.click("text=PNG")
    assert Path(picture.value.path()).read_bytes().startswith(b"\x89PNG")


def test_dropped_firmware_runs_and_changed_file_is_reloaded(browser: Browser, tmp_path: Path) -> None:
    program = tmp_path / "mine.elf"
    program.write_bytes(prebuilt("template", "I2C2").read_bytes())
    served = Served(Setup(str(program)))
    try:
        page = browser.open(served)
        until(page, "document.querySelector('#firmware').selectedOptions[0].textContent === 'mine.elf'")
        program.write_bytes(prebuilt("solution", "I2C2").read_bytes())
        until(page, "document.querySelector('#notices').textContent.includes('loaded again')")
        until(page, "document.querySelector('.xterm-rows').textContent.includes('Pitch:')")
        page.set_input_files(
            "input[type=file]",
            {"name": "dropped.elf", "mimeType": "application/octet-stream", "buffer": program.read_bytes()},
        )
        until(page, "document.querySelector('#firmware').selectedOptions[0].textContent === 'dropped.elf'")
        page.set_input_files(
            "input[type=file]", {"name": "evil.py", "mimeType": "text/plain", "buffer": b"print(1)"}
        )
        until(page, "document.querySelector('#notices .error')?.textContent.includes('evil.py')")
    finally:
        served.close()


def test_scenario_verdict_is_shown(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.click("#tab-scenario")
    page.select_option("#scenario", "led_x")
    until(page, "document.querySelector('#question').textContent.includes('LED1')")
    page.select_option("#speed", "max")
    until(page, "document.querySelectorAll('#verdicts [data-state=met]').length === 1")
    assert (page.text_content("#verdict-count") or "").startswith("1 of 1 expectation")


def test_page_with_scenario_first_shows_question(browser: Browser) -> None:
    served = Served(Setup("lab3", "led_x"))
    try:
        page = browser.open(served)
        until(page, "document.querySelector('#question').textContent.includes('LED1')")
        assert page.is_visible("#question")
        page.click("#tab-world")
        until(page, "document.querySelector('#num-attitude-roll').textContent.length > 2")
    finally:
        served.close()


def test_register_menu_stays_in_its_pane(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.click("#tab-registers")
    until(page, "document.querySelector('.registers select').options.length > 5")
    menu = page.eval_on_selector(".registers select", "one => one.getBoundingClientRect().right")
    assert menu <= page.eval_on_selector(".registers", "one => one.getBoundingClientRect().right")


def test_board_pauses_and_steps(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.click("#runner")
    until(
        page, "document.querySelector('#pace').textContent === 'paused'"
    )  # so its figures are the last ones
    ticks = int(page.text_content("#fig-ticks"))
    page.click("#step-tick")
    until(page, f"Number(document.querySelector('#fig-ticks').textContent) === {ticks} + 1")
    before = float(page.text_content("#time").split()[0])
    page.click("#step-second")
    until(page, f"Math.abs(parseFloat(document.querySelector('#time').textContent) - {before} - 1) < 0.0011")
    page.click("#runner")
    until(page, "document.body.dataset.state === 'running'")


def test_registers_and_bus_are_decoded(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.click("#tab-registers")
    until(page, "document.querySelector('[data-register=CTRL1_XL]')?.textContent.includes('ODR_XL 10')")
    page.click("#tab-bus")
    until(page, "/LSM6DSL OUTX_L_XL/.test(document.querySelector('.bus-table').textContent)")
    assert "mg" in page.text_content(".bus-table")


def test_chip_peripherals_and_pins_are_shown(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.click("#tab-registers")
    page.select_option("#peripheral", "TIM9")
    until(page, "document.querySelector('[data-register=CR1]')?.textContent.includes('CEN')")
    until(page, "document.querySelector('[data-register=CR1] .value').textContent.endsWith('1')")
    page.click("[data-part=LPS22HB]")
    until(page, "document.querySelector('[data-register=CTRL_REG1]') !== null")
    assert page.input_value("#peripheral") == ""
    page.click("#tab-pins")
    until(page, "document.querySelector('[data-pin=PB5]')?.dataset.level === 'high'")
    page.fill("#slide-pitch", "86")
    until(page, "document.querySelector('[data-pin=PB5]')?.dataset.level === 'low'")
    assert "LED1" in page.text_content("[data-pin=PB5]")


def test_button_of_input_is_pressed_in_pins_tab(browser: Browser) -> None:
    served = Served(Setup(ButtonReader, ideal=True))
    try:
        page = browser.open(served)
        page.click("#tab-pins")
        until(page, "document.querySelector('[data-pin=PA0]')?.dataset.level === 'high'")
        assert "PA0 0" not in str(page.text_content(".xterm-rows"))
        page.focus("[data-press=PA0]")
        page.keyboard.press("Enter")
        until(page, "document.querySelector('.xterm-rows').textContent.includes('PA0 0')")
        until(page, "document.querySelector('[data-pin=PA0]').dataset.level === 'high'")
        assert page.evaluate("document.activeElement.dataset.press") == "PA0"
    finally:
        served.close()


def test_board_with_other_sensors_is_shown(browser: Browser) -> None:
    served = Served(Setup(Reader, ideal=True, kind=GreenhouseBoard))
    try:
        page = browser.open(served)
        page.fill("#set-humidity", "62.5")
        page.press("#set-humidity", "Enter")
        row = "[data-output='HTX221.relative_humidity_percent']"
        until(page, f'document.querySelector("{row}")?.textContent.includes("62.50")')
        page.click("[data-subject=Hum]")
        until(page, "document.querySelector('.u-legend')?.textContent.includes('read')")
        assert page.locator("[data-subject=MAG]").count() == 0
        assert page.is_hidden(".setting.earth")
    finally:
        served.close()


def test_two_pages_show_one_board(browser: Browser, served: Served) -> None:
    one, other = browser.open(served), browser.open(served)
    one.fill("#slide-roll", "33")
    for page in (one, other):
        until(page, "document.querySelector('#num-attitude-roll').textContent === '33.0'")
    other.close()
    one.fill("#slide-roll", "-20")
    until(one, "document.querySelector('#num-attitude-roll').textContent === '-20.0'")


def test_page_reconnects_to_restarted_server(browser: Browser) -> None:
    first = Served(Setup(None))
    port = first.pages.address.port
    first.close()
    second = Served(Setup(None), port)
    page = browser.open(second)
    second.close()
    until(page, "document.body.classList.contains('lost')")
    third = Served(Setup("solution"), port)
    try:
        until(page, "!document.body.classList.contains('lost')")
        until(page, "document.querySelector('#firmware').value === 'solution'")
    finally:
        third.close()


class Evil(Echo):
    """Firmware that prints text that a page might mistake for its own HTML."""

    def main(self) -> None:
        while True:
            self._hal.HAL_UART_Transmit(b"<img src=x onerror=document.title='owned'>\x1b]0;owned\x07\n", 1000)
            self._hal.HAL_Delay(200)


def test_printed_text_is_escaped_in_page(browser: Browser) -> None:
    served = Served(Setup(Evil))
    try:
        page = browser.open(served)
        until(page, "document.querySelector('.xterm-rows').textContent.includes('<img src=x')")
        assert page.evaluate("document.querySelectorAll('img').length") == 0
        assert "owned" not in page.title()
    finally:
        served.close()


@pytest.mark.parametrize("width", [360, 420])
def test_page_fits_screen_of_phone(width: int, browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.set_viewport_size({"width": width, "height": 800})
    for pane in ("world", "registers", "bus", "pins", "scenario", "diagnosis"):
        page.click(f"#tab-{pane}")
        until(page, f"!document.querySelector('#pane-{pane}, .{pane}').hidden")
        assert page.evaluate("document.documentElement.scrollWidth") == width, pane


def test_token_leaves_address_but_survives_reload(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    assert "token" not in page.url
    page.reload()
    until(page, "document.body.dataset.state === 'running'")
    assert page.text_content("#connection") == ""
    other = page.context.new_page()
    other.goto(served.pages.url)
    until(other, "document.body.dataset.state === 'running'")
    assert page.context.cookies() == []


def test_page_without_token_shows_instructions(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.evaluate("sessionStorage.clear()")
    page.reload()
    until(page, "document.querySelector('#connection').textContent.includes('fcu web')")
    assert page.get_attribute("body", "data-state") is None
    page.goto(served.pages.url.replace("/#", "/?2d#"))  # only the fragment differs: nothing is loaded
    until(page, "document.body.dataset.state === 'running'")


def test_page_with_wrong_token_shows_error(browser: Browser, served: Served) -> None:
    page = browser.open(served)
    page.evaluate("sessionStorage.setItem('fcu-token', 'wrong')")
    page.reload()
    until(page, "document.querySelector('#connection').textContent.includes('fcu web')")
    assert page.get_attribute("body", "data-state") is None
