"""``fcu mcp``: a coding agent solves an exercise, and uses a live board, by the protocol's own client."""

from __future__ import annotations

import json
import math
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.agents.texts import MOST_BYTES, MOST_LINES
from fcu_emulator.emulator.agents.tools import LARGEST_RESULT, TOOLS
from fcu_emulator.emulator.chip.registers import DECLARED
from fcu_emulator.emulator.grading.judge import judge
from fcu_emulator.emulator.grading.rubric import load_rubric
from fcu_emulator.firmware_model.arm import prebuilt
from tests.arm.test_agreement_student import write_code
from tests.integration.test_cli_check import fcu
from tests.support.agent_client import AgentClient, connected
from tests.support.arm import student_programs
from tests.support.arm.broken_programs import FOLDER

pytestmark = pytest.mark.slow  # tests.slow does not see the processor time of a server that several tests use
needs_compiler = pytest.mark.skipif(
    not student_programs.is_buildable(), reason="arm-none-eabi-gcc or make is not installed"
)
FUNCTIONS, LOOP = 0, 1
ALTITUDE = """\
float alt;

static float getAltitude(float pressure, float degrees)
{
  float ratio = powf(press_zero_level / pressure, 1.0f / 5.257f);
  return (ratio - 1.0f) * (degrees + 273.15f) / 0.0065f;
}
"""
PRINTED = r"""
    alt = getAltitude(press, temperature);
    PRINTF("Altitude: %f m \n\r", alt);
"""


@pytest.fixture(scope="module")
def agent(tmp_path_factory: pytest.TempPathFactory) -> Iterator[AgentClient]:
    with connected(tmp_path_factory.mktemp("agent")) as client:
        yield client


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab") / "mylab"
    assert fcu("new", str(folder)).returncode == 0
    return folder


@pytest.fixture
def fresh(project: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(project, tmp_path / "mylab"))


def exercise(result: dict[str, Any], name: str) -> dict[str, Any]:
    (found,) = [one for one in result["exercises"] if one["exercise"] == name]
    return dict(found)


# -- A project ----------------------------------------------------------------------------------------------


@needs_compiler
def test_agent_solves_second_exercise(agent: AgentClient, fresh: Path) -> None:
    before = agent.call("check", target=str(fresh), exercises=["2"])
    first = exercise(before, "2")
    assert (before["exit_code"], first["state"], first["points"]) == (1, "not yet", 0)
    assert {one["title"] for one in first["failed_checks"]} == {
        "the altitude is 0 m at first, and follows the board on the stairs",
        "the altitude is printed once a second",
    }

    write_code(fresh, {FUNCTIONS: ALTITUDE, LOOP: PRINTED})
    built = agent.call("build", folder=str(fresh))
    assert built["built"]
    assert Path(built["file"]).is_file()
    after = agent.call("check", target=str(fresh), exercises=["2"])

    done = exercise(after, "2")
    assert (after["exit_code"], after["verdict"]) == (0, "passed")
    assert (done["state"], done["points"], done["max_points"]) == ("done", 4, 4)
    assert done["failed_checks"] == done["explanations"] == []


@needs_compiler
def test_wrong_formula_is_explained_with_line(agent: AgentClient, fresh: Path) -> None:
    wrong = ALTITUDE.replace("0.0065f", "0.0056f")
    write_code(fresh, {FUNCTIONS: wrong, LOOP: PRINTED})
    line = (fresh / "main.c").read_text().partition("0.0056f")[0].count("\n") + 1

    checked = exercise(agent.call("check", target=str(fresh), exercises=["2"]), "2")
    number = agent.call("explain", number="altitude", firmware=str(fresh / "lab3.elf"))

    for found in (checked["explanations"], number["explanations"]):
        assert found[0]["kind"] == "formula"
        assert found[0]["data"]["file"].endswith("main.c")
        assert found[0]["data"]["line"] == str(line)
    assert number["number"] == "Altitude"


@needs_compiler
def test_compiler_error_is_result_with_line(agent: AgentClient, fresh: Path) -> None:
    write_code(fresh, {FUNCTIONS: "float alt\n"})
    built = agent.call("build", folder=str(fresh))
    checked = agent.call("check", target=str(fresh))

    assert (built["built"], built["file"]) == (False, None)
    assert re.search(r"main\.c:\d+:\d+: error: expected", built["compiler"]["text"])
    assert checked["exit_code"] == 2
    assert "main.c" in checked["errors"]["text"]


@needs_compiler
def test_compiler_warning_is_shown(agent: AgentClient, fresh: Path) -> None:
    write_code(fresh, {FUNCTIONS: "static int unused_one;\n"})
    built = agent.call("build", folder=str(fresh))

    assert built["built"]
    assert "unused_one" in built["compiler"]["text"]


def test_check_equals_fcu_check(agent: AgentClient) -> None:
    result = agent.call("check", target="template-arm", exercises=["4"], seed=3)
    verdict = judge("template-arm", load_rubric("lab3"), seed=3, exercises=["4"])

    wrong = [one for one in verdict.of("4") if one.max_points]
    assert result["points"] == verdict.points
    assert [(one["title"], one["seen"], one["hint"]) for one in exercise(result, "4")["failed_checks"]] == [
        (one.title, one.actual, one.hint) for one in wrong
    ]
    assert result["screen"]["text"] == fcu("check", "template-arm", "-e", "4", "--seed", "3").stdout.rstrip(
        "\n"
    )


def test_run_plays_scenario(agent: AgentClient) -> None:
    passed = agent.call("run", firmware="solution", scenario="led_x")
    failed = agent.call("run", firmware="template-arm", scenario="led_x")

    assert (passed["exit_code"], passed["verdict"]) == (0, "passed")
    assert passed["expectations"]["held"] == passed["expectations"]["checks"] > 0
    assert (failed["exit_code"], failed["verdict"]) == (1, "failed")
    assert failed["expectations"]["findings"]
    assert "LAB3 Init..." in failed["terminal"]["text"]


def test_crashing_firmware_is_diagnosed(agent: AgentClient) -> None:
    result = agent.call("run", firmware=str(FOLDER / "outside_memory.elf"), duration="2s")

    assert (result["exit_code"], result["verdict"]) == (3, "firmware failed")
    assert "outside_memory.c:20" in result["error"]


# -- A live board -------------------------------------------------------------------------------------------


def test_expected_output_follows_motion_of_board(agent: AgentClient) -> None:
    started = agent.call("start_board", firmware="solution", ideal=True)
    assert (started["now_s"], started["state"], started["leds"]["LED1"]) == (0, "ready", False)
    printed = agent.call("run_board", seconds=1.5)
    assert printed["now_s"] == 1.5
    assert "LAB3 Init..." in printed["printed"]

    moved = agent.call("act", entry={"do": "rotate_to", "pitch_deg": 85, "for": "500ms"})
    assert moved["now_s"] == 1.5
    found = agent.call("expect", text="Pitch: 8", timeout_s=5)

    assert found["found"]
    assert re.fullmatch(r"Pitch: 8[45]\.\d+ deg Roll: .* deg Yaw: .* deg", found["line"])
    assert found["attitude"]["pitch_deg"] == pytest.approx(85)
    assert found["leds"]["LED1"]


def test_board_equals_python_api(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution", seed=7)
    agent.call("run_board", seconds=1.75)
    with Board("solution", seed=7) as board:
        board.run_for(1.75)
        text = [line.rstrip("\r ") for line in board.terminal.text.replace("\n\r", "\n").splitlines()]
        pitch = board.variable("pitch")

    shown = agent.call("terminal")["text"].splitlines()
    assert [line.rstrip() for line in shown] == text
    assert agent.call("variables", names=["pitch"])["values"]["pitch"] == pitch


def test_search_for_missing_text_ends_in_time(agent: AgentClient) -> None:
    agent.call("start_board", firmware="template-arm")
    missing = agent.call("expect", text="Altitude", timeout_s=2.5)

    assert not missing["found"]
    assert missing["now_s"] == 2.5
    assert "ACC[x,y,z]" in missing["printed"]
    assert "ended_early" not in missing


def test_expected_text_is_literal(agent: AgentClient) -> None:
    agent.call("start_board", firmware="template-arm")
    assert agent.call("expect", text="ACC[x,y,z] ", timeout_s=2)["found"]
    assert not agent.call("expect", text="ACC.x,y,z. ", timeout_s=0, since=0)["found"]


def test_search_continues_after_earlier_match(agent: AgentClient) -> None:
    agent.call("start_board", firmware="template-arm")
    agent.call("run_board", seconds=2.5)
    first = agent.call("expect", text="Pre: ", timeout_s=0, since=0)
    second = agent.call("expect", text="Pre: ", timeout_s=0, since=first["match_end"])

    assert first["found"]
    assert second["found"]
    assert second["match_end"] > first["match_end"]


def test_registers_are_decoded(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution")
    agent.call("run_board", seconds=1.2)
    (rate,) = agent.call("registers", part="lsm6dsl", register="ctrl1_xl")["registers"]
    (clock,) = agent.call("registers", part="RCC", register="APB1ENR")["registers"]

    assert rate["value"] == "0xA8"  # 6664 Hz, 4 g: LSM6DSL datasheet, CTRL1_XL
    assert rate["fields"]["ODR_XL"] == 10
    assert rate["fields"]["FS_XL"] == 2
    assert "6664 Hz" in rate["meanings"]["ODR_XL"]
    assert clock["fields"]["I2C2EN"] == 1


def test_registers_are_read_in_pages(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution")
    names, first = [], 0
    while True:
        page = agent.call("registers", part="LSM6DSL", first=first)
        names += [one["name"] for one in page["registers"]]
        if "rest" not in page:
            break
        first = int(re.search(r"first=(\d+)\)", page["rest"])[1])  # type: ignore[index]

    with Board("solution") as board:
        assert names == [one.__name__ for one in board.sensors["LSM6DSL"].MAP.registers]
    assert len(names) > 50


@pytest.mark.parametrize("part", DECLARED)
def test_every_peripheral_fits_into_result(agent: AgentClient, part: str) -> None:
    agent.call("start_board", firmware="solution")
    answer = agent.answer("registers", part=part)

    assert answer.error.startswith("unknown part") or len(answer.data["registers"]) <= 40


def test_variables_of_python_firmware_are_read(agent: AgentClient) -> None:
    agent.call("start_board", firmware="lab3")
    assert {"acc", "pitch"} <= set(agent.call("variables")["names"])
    assert agent.call("variables", names=["acc"])["values"].keys() == {
        "acc.AXIS_X",
        "acc.AXIS_Y",
        "acc.AXIS_Z",
    }
    assert all(
        isinstance(value, float) and math.isfinite(value)
        for value in agent.call("variables", names=["pitch"])["values"].values()
    )


def test_transfers_are_decoded(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution", ideal=True)
    agent.call("run_board", seconds=1.2)
    recorded = agent.call("transfers", run_s=0.01)
    latest = agent.call("transfers")

    reads = [one for one in recorded["transfers"] if one["register"] == "OUTX_L_XL"]
    assert recorded["count"] == 32  # eight callbacks, each reads four groups of registers
    assert len(reads) == 8
    assert [float(one) for one in reads[0]["meaning"].removesuffix(" mg").split()] == pytest.approx(
        [0, 0, 1000], abs=1
    )
    assert latest["transfers"]
    assert latest["now_s"] == recorded["now_s"]


def test_failed_firmware_can_still_be_read(agent: AgentClient) -> None:
    agent.call("start_board", firmware=str(FOLDER / "outside_memory.elf"))
    agent.call("run_board", seconds=2)
    problems = agent.call("explain")["problems"]
    registers = agent.call("registers", part="SCB")["registers"]

    assert problems[0]["fatal"]
    assert "outside_memory.c:20" in problems[0]["summary"]
    assert registers


def test_scenario_on_live_board_refuses_moves(agent: AgentClient) -> None:
    started = agent.call("start_board", scenario="led_x", firmware="solution")
    assert {one["state"] for one in started["expectations"]} == {"open"}
    assert "it plays the scenario led_x" in agent.error("act", entry={"do": "lift", "metres": 1, "for": "1s"})
    assert agent.call("run_board", seconds=30)["expectations"][0]["state"] == "met"


def test_firmware_that_does_not_start_keeps_board(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution", seed=2)
    agent.call("run_board", seconds=0.5)
    agent.error("start_board", firmware="no_such.elf")

    assert agent.call("run_board", seconds=0)["now_s"] == 0.5


# -- Bounds -------------------------------------------------------------------------------------------------


def assert_is_page(text: str) -> None:
    assert len(text.encode()) <= MOST_BYTES
    assert len(text.splitlines()) <= MOST_LINES


def whole(agent: AgentClient, first: dict[str, Any]) -> str:
    """Return a whole text: read its rest with the calls that the results name."""
    pages = [first]
    while "rest" in pages[-1]:
        name, line = re.fullmatch(r'read_text\(name="(.+)", first_line=(\d+)\)', pages[-1]["rest"]).groups()  # type: ignore[union-attr]
        pages.append(agent.call("read_text", name=name, first_line=int(line)))
    for one in pages:
        assert_is_page(one["text"])
    return "\n".join(one["text"] for one in pages)


def test_long_output_of_run_is_read_in_pages(agent: AgentClient) -> None:
    result = agent.call("run", firmware="template-arm", duration="40s")
    done = fcu("run", "template-arm", "--duration", "40s", "--speed", "max")

    assert re.fullmatch(r"lines 1 to \d+ of \d+", result["terminal"]["cut"])
    text = whole(agent, result["terminal"])
    expected = done.stdout.replace("\r", "")
    assert text.replace("\\x0d", "").split() == expected.split()


def test_record_of_run_is_kept(agent: AgentClient) -> None:
    result = agent.call("run", firmware="solution", duration="5s")
    name = result["record"]["name"]
    text = whole(agent, agent.call("read_text", name=name))

    assert len(text.splitlines()) == result["record"]["lines"]
    assert json.loads(text)["virtual_s"] == 5


def test_long_output_of_board_is_cut_at_beginning(agent: AgentClient) -> None:
    agent.call("start_board", firmware="template-arm")
    result = agent.call("run_board", seconds=40)
    assert_is_page(result["printed"])
    assert result["rest"] == "terminal(since=0)"
    assert result["printed"].rstrip().endswith("*****")

    text, since = "", 0
    while since < result["position"]:
        page = agent.call("terminal", since=since)
        assert_is_page(page["text"])
        assert (page["from"], page["end"]) == (since, result["position"])
        text, since = f"{text}{page['text']}\n", page["to"]
    with Board("template-arm") as board:
        board.run_for(40)
        assert text.split() == board.terminal.text.split()


def test_recording_of_transfers_is_bounded(agent: AgentClient) -> None:
    agent.call("start_board", firmware="solution")
    result = agent.call("transfers", run_s=2)

    assert len(result["transfers"]) == 100
    assert result["count"] > 1000
    assert result["cut"] == f"the first 100 of {result['count']} transfers"
    assert len(json.dumps(result, ensure_ascii=False).encode()) <= LARGEST_RESULT


# -- Wrong and hostile arguments ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tool", "arguments"),
    [
        ("no_such_tool", {}),
        ("build", {}),
        ("build", {"folder": 3}),
        ("build", {"folder": ""}),
        ("build", {"folder": "a\0b"}),
        ("build", {"folder": "a\nb"}),
        ("build", {"folder": "x" * 100_000}),
        ("build", {"folder": "x" * 4000}),
        ("build", {"folder": "no/such/folder"}),
        ("build", {"folder": "--help"}),
        ("build", {"folder": ".", "shell": "rm -rf /"}),
        ("check", {"target": "--json=stolen"}),
        ("check", {"target": "/dev/zero"}),
        ("check", {"target": "solution", "exercises": ["--json=stolen"]}),
        ("check", {"target": "solution", "exercises": ["99"]}),
        ("check", {"target": "solution", "exercises": ["1"] * 1000}),
        ("check", {"target": "solution", "seed": -1}),
        ("run", {"firmware": "--trace=stolen"}),
        ("run", {"firmware": "-q"}),
        ("run", {"firmware": "/etc/passwd", "duration": "1s"}),
        ("run", {"firmware": "lab3", "scenario": "--trace=stolen"}),
        ("run", {"firmware": "lab3", "scenario": "/dev/zero"}),
        ("run", {"firmware": "lab3", "scenario": "../../etc/passwd"}),
        ("run", {"firmware": "lab3", "duration": "forever"}),
        ("run", {"firmware": "lab3", "duration": "-5s"}),
        ("run", {"firmware": "lab3", "wiring": "$(touch stolen)"}),
        ("read_text", {"name": "../pyproject.toml"}),
        ("read_text", {"name": "student.md", "first_line": 10**6}),
        ("read_text", {"name": "student.md", "first_line": 10**30}),
        ("start_board", {"firmware": "/dev/zero"}),
        ("start_board", {"firmware": "/etc/passwd"}),
        ("start_board", {"firmware": "lab3", "seed": "x"}),
        ("act", {"entry": {}}),
        ("act", {"entry": {"do": "lift", "metres": 1e308, "for": "1s"}}),
        ("act", {"entry": {"do": "replay", "csv": "/etc/passwd"}}),
        ("act", {"entry": {"do": "hold", "at": "1s"}}),
        ("act", {"entry": {"do": {"do": ["x"] * 1000}}}),
        ("act", {"entry": "lift"}),
        ("run_board", {"seconds": -1}),
        ("run_board", {"seconds": 1e300}),
        ("expect", {"text": ""}),
        ("expect", {"text": "x" * 100_000}),
        ("terminal", {"since": -1}),
        ("registers", {"part": "__class__"}),
        ("registers", {"part": "LSM6DSL", "register": "NOPE"}),
        ("variables", {"names": ["__dict__"]}),
        ("variables", {"names": ["pitch.__class__"]}),
        ("variables", {"names": ["[" * 100]}),
        ("variables", {"names": ["x"] * 10_000}),
        ("transfers", {"run_s": 1e9}),
        ("explain", {"number": "Nope"}),
        ("explain", {"number": "Pitch", "firmware": "/etc/passwd"}),
    ],
)
def test_wrong_argument_gets_one_line(agent: AgentClient, tool: str, arguments: dict[str, Any]) -> None:
    agent.call("start_board", firmware="lab3")
    agent.error(tool, **arguments)

    assert agent.call("run_board", seconds=0)["state"] == "ready"


def test_options_in_arguments_write_no_file(agent: AgentClient, tmp_path: Path) -> None:
    stolen = tmp_path / "stolen"
    for arguments in (
        {"firmware": f"--trace={stolen}"},
        {"firmware": "lab3", "scenario": f"x --trace={stolen}"},
    ):
        agent.error("run", **arguments)
    agent.error("check", target=f"--json={stolen}")

    assert not stolen.exists()


def test_contents_of_other_file_are_not_shown(agent: AgentClient, tmp_path: Path) -> None:
    file = tmp_path / "notes.toml"
    file.write_text("first line\nsecret: 4711 4711 4711\n")
    calls: list[tuple[str, dict[str, Any]]] = [
        *((tool, {"firmware": str(file)}) for tool in ("run", "start_board")),
        *((tool, {"firmware": "lab3", "scenario": str(file)}) for tool in ("run", "start_board")),
        ("check", {"target": str(file)}),
        ("build", {"folder": str(file)}),
        ("explain", {"number": "Pitch", "firmware": str(file)}),
        ("read_text", {"name": str(file)}),
    ]
    for tool, arguments in calls:
        assert "4711" not in agent.error(tool, **arguments)


def test_deep_entry_is_refused(agent: AgentClient) -> None:
    entry: dict[str, Any] = {"do": "lift"}
    for _ in range(100):
        entry = {"do": entry}
    agent.call("start_board", firmware="lab3")

    agent.error("act", entry=entry)


def test_board_tools_need_board(tmp_path: Path) -> None:
    with connected(tmp_path) as client:
        for tool, arguments in (
            ("run_board", {"seconds": 1}),
            ("act", {"entry": {"do": "hold"}}),
            ("registers", {"part": "RCC"}),
            ("explain", {}),
        ):
            assert "start_board" in client.error(tool, **arguments)


# -- The protocol -------------------------------------------------------------------------------------------


def test_every_tool_is_described(agent: AgentClient) -> None:
    tools = agent.ask("list_tools").tools

    assert [one.name for one in tools] == list(TOOLS)
    for one in tools:
        assert len(one.description) > 60
        assert one.input_schema["additionalProperties"] is False
        assert all(field.get("description") for field in one.input_schema["properties"].values())


def test_client_of_older_protocol_is_served(tmp_path: Path) -> None:
    with connected(tmp_path, mode="legacy") as client:
        assert [one.name for one in client.ask("list_tools").tools] == list(TOOLS)
        assert client.call("start_board", firmware="lab3")["state"] == "ready"
        assert "check" in client.client.instructions


def test_shipped_programs_are_known_by_name(agent: AgentClient) -> None:
    assert agent.call("start_board", firmware=str(prebuilt("solution", "I2C2")))["state"] == "ready"
