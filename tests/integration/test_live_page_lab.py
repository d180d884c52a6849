"""The page for a student: the first visit, an exercise, a crash, a reload, and the lines of the plot."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator.emulator.cli.exercises import LabExercises
from fcu_emulator.emulator.live import gestures
from fcu_emulator.emulator.live.setup import Setup
from fcu_emulator.emulator.python_cpu.hal import VirtualHal
from fcu_emulator.firmware_model.arm import prebuilt
from tests.integration import test_live_page as live
from tests.integration.test_live_page import until
from tests.support.arm.broken_programs import FOLDER

chromium, browser, served = live.chromium, live.browser, live.served
pytestmark = live.pytestmark


@pytest.fixture
def lab() -> Iterator[live.Served]:
    one = live.Served(Setup(prebuilt("template", "I2C2"), ideal=True), exercises=LabExercises())
    yield one
    one.close()


# -- first sight --------------------------------------------------------------------------------------------


def test_exercise_is_checked_from_page(browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab)
    assert page.is_visible("#check")
    assert page.text_content("#exercise-question").endswith("?")
    page.select_option("#exercise", "4")
    page.click("#check")
    until(page, "document.querySelector('.exercise').dataset.state === 'checking'")
    until(page, "document.querySelector('.exercise').dataset.state === 'not yet'")
    assert page.locator("#exercise-checks [data-outcome=failed]").count() > 0
    assert page.get_attribute("body", "data-state") == "running"
    assert lab.session.run_number == 1
    page.reload()
    until(page, "document.querySelector('.exercise').dataset.state === 'not yet'")
    assert page.input_value("#exercise") == "4"


def test_check_is_disabled_until_exercises_have_arrived(browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab)
    assert page.is_enabled("#check")
    page.evaluate("sessionStorage.clear()")
    page.goto(lab.pages.url.split("/#")[0] + "/?2d&without-token")  # no list of exercises ever arrives
    until(page, "document.querySelector('#check') !== null")
    assert page.is_disabled("#check")


def test_each_world_field_has_its_own_label(browser: live.Browser, served: live.Served) -> None:
    page = browser.open(served)
    at_sensor = page.locator("tr:has(#num-mag-x) th").text_content()
    earth = page.locator(".earth > span").first.text_content()
    assert "Earth" in earth
    assert "sensor" in at_sensor
    assert page.locator("tr:has(#num-mag-x)").get_attribute("title")


def test_tour_is_shown_on_first_visit_only(browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab, first_visit=True)
    until(page, "!document.querySelector('#tour').hidden")
    titles = [page.text_content("#tour-title")]
    page.click("#tour-next")
    titles.append(page.text_content("#tour-title"))
    assert len(set(titles)) == 2
    page.click("#tour-skip")
    assert page.is_hidden("#tour")
    page.reload()
    until(page, "document.querySelector('#time')?.textContent.length > 7")
    assert page.is_hidden("#tour")
    page.click("#help")
    page.click("#tour-again")
    assert page.is_visible("#tour")
    page.keyboard.press("Escape")
    assert page.is_hidden("#tour")


def test_question_mark_key_shows_shortcuts(browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab)
    page.keyboard.press("?")
    assert page.is_visible("#keys")
    shown = page.locator("#keys kbd").all_text_contents()
    assert {"Space", ".", ",", "?", "Q", "E", "0", "PageUp", "PageDown"} <= set(shown)
    page.keyboard.press("Escape")
    assert page.is_hidden("#keys")
    page.focus("#reset")  # a button takes Space, and no other key
    page.keyboard.press("?")
    assert page.is_visible("#keys")


def test_scenarios_are_listed_with_their_questions(browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab)
    page.click("#tab-scenario")
    rows = page.locator("#scenarios button")
    assert rows.count() == page.locator("#scenario option").count() - 1
    assert all("?" in text for text in rows.all_text_contents())
    page.click("[data-scenario=led_x]")
    until(page, "document.querySelector('#question').textContent.includes('LED1')")
    assert page.input_value("#scenario") == "led_x"
    assert page.is_hidden("#scenarios")


def test_gestures_have_same_names_as_in_scenarios(browser: live.Browser, served: live.Served) -> None:
    page = browser.open(served)
    words = page.eval_on_selector_all("[data-gesture]", "all => all.map(one => one.dataset.gesture)")
    assert words == [one["word"] for one in gestures.buttons()]
    page.click("[data-gesture=turn_over]")
    until(page, "Math.abs(Number(document.querySelector('#num-attitude-roll').textContent)) > 170")
    page.click("[data-gesture=flat]")
    until(page, "document.querySelector('#num-attitude-roll').textContent === '0.0'")


# -- failures -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("program", "place"),
    [
        ("outside_memory", "HAL_TIM_PeriodElapsedCallback(), outside_memory.c:20"),
        ("poll_without_clock", "poll_without_clock.c"),
    ],
)
def test_crash_or_hang_is_shown_immediately(program: str, place: str, browser: live.Browser) -> None:
    failing = live.Served(Setup(FOLDER / f"{program}.elf"))
    try:
        page = browser.open(failing)
        until(page, f"document.querySelector('#failure-text').textContent.includes('{place}')")
        assert page.is_visible("#failure")
        until(page, f"document.querySelector('.xterm-rows').textContent.includes('{place}')")
        until(page, "document.querySelector('#pace').textContent === 'stopped'")
        page.click("#failure >> text=Details")
        assert place in page.text_content("#pane-diagnosis")
        link = page.locator("#pane-diagnosis a").first
        assert link.get_attribute("href").startswith(
            f"vscode://file/{FOLDER.as_posix().lstrip('/')}/{program}.c:"
        )
    finally:
        failing.close()


class Dies:
    """Firmware in Python that raises an exception."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        self._hal.HAL_UART_Transmit(b"last words\n", 1000)
        raise ValueError("no such sensor")

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""


def test_stop_is_marked_after_printed_text(browser: live.Browser) -> None:
    failing = live.Served(Setup(Dies))
    try:
        page = browser.open(failing)
        until(page, "/last words.*stopped/s.test(document.querySelector('.xterm-rows').textContent)")
        assert page.is_visible("#failure")
        page.select_option("#firmware", "solution")
        until(page, "document.querySelector('#failure').hidden")
        until(page, "document.querySelector('#pace').textContent !== 'stopped'")
    finally:
        failing.close()


# -- a session that goes on ---------------------------------------------------------------------------------


def columns(page: Any) -> list[dict[str, str]]:
    """Return the rows of the plot's CSV file."""
    with page.expect_download() as download:
        page.click("text=CSV")
    header, *rows = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
    names = header.replace('"', "").split(",")
    return [dict(zip(names, row.split(","), strict=True)) for row in rows]


def test_reload_and_second_page_show_past_data(browser: live.Browser, served: live.Served) -> None:
    page = browser.open(served)
    page.click("[data-subject=variables]")
    page.fill("[placeholder='Add a variable']", "pitch")
    page.press("[placeholder='Add a variable']", "Enter")
    until(page, "parseFloat(document.querySelector('#time').textContent) > 4")
    page.reload()
    until(page, "document.querySelector('.u-legend')?.textContent.includes('pitch')")
    page.click("#runner")
    until(page, "document.body.dataset.state === 'paused'")
    assert float(columns(page)[0]["t_s"]) < 2.5
    page.click("[data-subject=angles]")
    rows = columns(page)
    assert float(rows[0]["t_s"]) < 1
    assert [row for row in rows if row["Pitch printed (deg)"]]
    other = browser.open(served)
    until(other, "document.querySelector('.u-legend')?.textContent.includes('Pitch printed')")
    assert float(columns(other)[0]["t_s"]) < 1


def test_firmware_name_is_kept_after_pause(browser: live.Browser) -> None:
    loaded = live.Served(Setup(FOLDER / "fine_quiet.elf"))
    try:
        page = browser.open(loaded)
        for state in ("paused", "running", "paused"):  # each comes with a status
            page.click("#runner")
            until(page, f"document.body.dataset.state === '{state}'")
            assert page.eval_on_selector("#firmware", "one => one.selectedOptions[0].textContent") == (
                "fine_quiet.elf"
            )
    finally:
        loaded.close()


def test_unknown_variable_is_refused_with_message(browser: live.Browser, served: live.Served) -> None:
    page = browser.open(served)
    page.click("[data-subject=variables]")
    for name in ("pitch", "pich"):
        page.fill("[placeholder='Add a variable']", name)
        page.press("[placeholder='Add a variable']", "Enter")
    until(page, "document.querySelector('#notices .error')?.textContent.includes('pich')")
    assert "pitch" in page.text_content("#notices .error")
    assert page.locator(".chips button").all_text_contents() == ["pitch \N{MULTIPLICATION SIGN}"]
    assert page.input_value("[placeholder='Add a variable']") == "pich"


# -- the plot's lines ---------------------------------------------------------------------------------------

MARKERS = (
    "[...document.querySelectorAll('.u-legend .u-marker')].map(one => one.style.borderColor).filter(Boolean)"
)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_two_series_share_colour(theme: str, browser: live.Browser, lab: live.Served) -> None:
    page = browser.open(lab, theme=theme)
    page.evaluate("sessionStorage.setItem('fcu-watched', 'acc\\ngyro\\nmag\\npress')")
    page.reload()
    until(page, "document.querySelector('.u-legend')?.textContent.includes('truth')")
    for subject in page.eval_on_selector_all("[data-subject]", "all => all.map(one => one.dataset.subject)"):
        page.click(f"[data-subject={subject}]")
        least = 10 if subject == "variables" else 1
        until(page, f"{MARKERS}.length >= {least}")
        colours = page.evaluate(MARKERS)
        assert len(set(colours)) == len(colours), subject


PIXELS = """line => {
    const canvas = document.querySelector('.u-wrap canvas'), { width, height } = canvas;
    const probe = new OffscreenCanvas(1, 1).getContext('2d');
    probe.fillStyle = line;
    probe.fillRect(0, 0, 1, 1);
    const wanted = probe.getImageData(0, 0, 1, 1).data;
    const { data } = canvas.getContext('2d').getImageData(0, 0, width, height);
    let low = height, high = 0, longest = 0;
    for (let x = 0; x < width; x++) {
        let run = 0;
        for (let y = 0; y < height; y++) {
            const at = 4 * (y * width + x);
            const same = [0, 1, 2].every(one => Math.abs(data[at + one] - wanted[one]) < 12);
            run = same && data[at + 3] > 200 ? run + 1 : 0;
            if (!run) continue;
            [low, high, longest] = [Math.min(low, y), Math.max(high, y), Math.max(longest, run)];
        }
    }
    return { spread: (high - low) / height, longest: longest / height };
}"""


class Compass:
    """Firmware that prints a yaw which wraps in each second line, and a roll of some degrees."""

    def __init__(self, hal: VirtualHal) -> None:
        self._hal = hal

    def main(self) -> None:
        number = 0
        while True:
            number += 1
            yaw, roll = 179 if number % 2 else -179, (number % 5) * 2
            self._hal.HAL_UART_Transmit(
                f"Pitch: 1.000000 deg Roll: {roll:.6f} deg Yaw: {yaw:.6f} deg \n\r".encode(), 1000
            )
            self._hal.HAL_Delay(200)

    def HAL_TIM_PeriodElapsedCallback(self) -> None:
        """The timer is not used."""


def test_wrapping_yaw_has_gaps_without_flattening_other_series(browser: live.Browser) -> None:
    turning = live.Served(Setup(Compass))
    try:
        page = browser.open(turning)
        until(page, "parseFloat(document.querySelector('#time').textContent) > 6")
        page.click("#runner")
        until(page, "document.body.dataset.state === 'paused'")
        until(page, "document.querySelector('.u-legend').textContent.includes('Yaw printed')")
        names = page.locator(".u-legend th").all_text_contents()
        colours = page.evaluate(MARKERS)
        of = dict(zip(names[len(names) - len(colours) :], colours, strict=True))
        assert page.evaluate(PIXELS, of["Roll printed"])["spread"] > 0.4
        yaw = page.evaluate(PIXELS, of["Yaw printed"])
        assert yaw["spread"] > 0.5  # it is at both ends
        assert yaw["longest"] < 0.2  # and no line joins them
    finally:
        turning.close()
