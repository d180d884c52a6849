"""A run for other tools: wires that sigrok decodes to the transfers of the trace, a time line, a plot."""

from __future__ import annotations

import contextlib
import json
import re
import shutil
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from fcu_emulator import Board
from fcu_emulator.emulator.analysis import waves
from fcu_emulator.emulator.analysis.perfetto import PerfettoFile
from fcu_emulator.emulator.analysis.plot import draw
from fcu_emulator.emulator.analysis.vcd import VcdFile
from fcu_emulator.emulator.cli.plot import draw_record
from fcu_emulator.emulator.errors import I2CNackError, InputError, LinkError, OutputError
from fcu_emulator.emulator.trace import BusTransfer, TerminalBytes
from tests.integration.test_docs import fcu

ALL_BYTES = bytes(range(256))
needs_sigrok = pytest.mark.skipif(shutil.which("sigrok-cli") is None, reason="sigrok-cli is not installed")


@pytest.fixture(params=[("solution", None), ("lab3", None), ("solution", "fcu001v1")], ids=str)
def recorded(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Board, Path]:
    """Return a board that has run until it measures, and its wires."""
    firmware, wiring = request.param
    return record_wires(tmp_path, firmware, wiring)


def record_wires(folder: Path, firmware: str, wiring: str | None) -> tuple[Board, Path]:
    board = Board(firmware=firmware, wiring=wiring)
    board.run_for(1.06)
    board.trace.record_all()
    board.run_until_ps(board.clock.now_ps + 1)
    path = folder / "run.vcd"
    with contextlib.closing(VcdFile(board, path)):
        board.run_for(0.06)
    return board, path


def sigrok(path: Path, decoder: str, annotations: str) -> list[str]:
    done = subprocess.run(
        ["sigrok-cli", "-i", str(path), "-P", decoder, "-A", annotations],
        capture_output=True,
        text=True,
        check=True,
        timeout=120,
    )
    return [line.partition(": ")[2] for line in done.stdout.splitlines()]


def whole(board: Board) -> list[BusTransfer]:
    """Return the transfers that are completely in the file."""
    begin = board.clock.now_ps - 60 * 10**9
    return [one for one in board.trace.of(BusTransfer) if one.t_ps >= begin]


@needs_sigrok
def test_sigrok_decodes_transfers_of_trace(recorded: tuple[Board, Path]) -> None:
    board, path = recorded
    transfers = whole(board)
    assert len(transfers) > 50
    if board.booted.wiring.bus == "I2C2":
        lines = sigrok(path, "i2c:scl=I2C2_SCL:sda=I2C2_SDA", "i2c=addr-data")
        expected = [line for one in transfers for line in as_i2c(one)]
    else:
        wires = "clk=SPI2_SCK:mosi=SPI2_SDIO:cs=SPI2_CS_LSM6DSL:cpol=1:cpha=1"
        lines = sigrok(path, f"spi:{wires}", "spi=mosi-data")
        mine = [one for one in transfers if one.device == "LSM6DSL"]
        expected = [f"{byte:02X}" for one in mine for byte in one.written + one.read]
    assert len(lines) > 0.9 * len(expected)  # the last transfer may be cut off
    assert lines == expected[: len(lines)]


def as_i2c(one: BusTransfer) -> Iterator[str]:
    """Return a transfer in the form of sigrok's decoder."""
    if one.written:
        yield from ("Start", "Write", f"Address write: {one.address:02X}", "ACK")
        for byte in one.written:
            yield from (f"Data write: {byte:02X}", "ACK")
    if one.read:
        start = "Start repeat" if one.written else "Start"
        yield from (start, "Read", f"Address read: {one.address:02X}", "ACK")
        for number, byte in enumerate(one.read, 1):
            yield from (f"Data read: {byte:02X}", "NACK" if number == len(one.read) else "ACK")
    yield "Stop"


@needs_sigrok
def test_sigrok_decodes_text(tmp_path: Path) -> None:
    board = Board(firmware="solution")
    path = tmp_path / "run.vcd"
    with contextlib.closing(VcdFile(board, path)):
        board.run_for(0.001)  # a line is idle before its first frame
        board.terminal.write(ALL_BYTES)
        board.run_for(0.05)
    wires = "uart:rx=USART1_TX:tx=USART1_RX:baudrate=115200:format=hex"
    read = sigrok(path, wires, "uart=rx-data")
    typed = sigrok(path, wires, "uart=tx-data")
    printed = bytes.fromhex("".join(read))
    assert len(printed) > 30
    assert printed == board.terminal.text.encode("latin-1")[: len(printed)]
    assert bytes.fromhex("".join(typed)) == ALL_BYTES


def changes(path: Path) -> dict[str, list[tuple[int, int]]]:
    """Return the changes of each wire with times in ps, read according to the format's standard."""
    text = path.read_text(encoding="ascii")
    assert "$timescale 10 ns $end" in text
    names = dict(re.findall(r"\$var wire 1 (\S+) (\S+) \$end", text))
    found: dict[str, list[tuple[int, int]]] = {name: [] for name in names.values()}
    at = 0
    for line in text.split("$enddefinitions $end")[1].split():
        if line.startswith("#"):
            assert int(line[1:]) >= at
            at = int(line[1:])
        elif line[0] in "01":
            found[names[line[1:]]].append((at * 10_000, int(line[0])))
    return found


def test_wires_show_leds_and_interrupt_pins_and_callback(tmp_path: Path) -> None:
    board = Board(firmware="solution", ideal=True)
    board.world.set_attitude(0, 86, 0)
    board.run_for(1.0)
    path = tmp_path / "run.vcd"
    with contextlib.closing(VcdFile(board, path)) as file:
        board.run_for(0.15)
        board.i2c2.write(0x6B, b"\x0d\x01")  # data ready of the accelerometer on INT1
        board.run_for(0.1)
    found = changes(path)
    assert [level for _, level in found["LEDs_LED1"]][-1] == int(board.led1.on) == 1
    assert [level for _, level in found["LEDs_LED2"]][-1] == int(board.led2.on) == 0
    assert sum(level for at, level in found["LSM6DSL_INT1"] if at > 1.15e12) > 5
    began = [at for at, level in found["firmware_TIM9_callback"] if level]
    apart = [b - a for a, b in zip(began[-20:], began[-19:], strict=False)]
    assert sum(apart) / len(apart) == pytest.approx(1.25e9, rel=0.02)
    assert file.report() == []


def test_equal_runs_give_equal_files_and_text(tmp_path: Path) -> None:
    texts, files = [], []
    for _ in range(2):
        board, path = record_wires(tmp_path, "solution", None)
        texts.append(board.terminal.text)
        files.append(path.read_bytes())
    assert files[0] == files[1]
    unseen = Board(firmware="solution")
    unseen.run_until_ps(board.clock.now_ps)
    assert texts == [unseen.terminal.text] * 2


def test_refused_message_is_drawn_until_its_nack() -> None:
    result = str(I2CNackError(0x6B, 1))
    nack = BusTransfer(0, 21 * 100, "I2C2", 0x6B, "LSM6DSL", "X", b"\x10\x40", b"", result)
    edges = list(waves.i2c(nack, "SCL", "SDA") or ())
    rising = [at for at, wire, level in edges if (wire, level) == ("SCL", 1)]
    levels = [[level for t, wire, level in edges if wire == "SDA" and t <= at][-1] for at in rising[:-1]]
    assert levels == [1, 1, 0, 1, 0, 1, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    broken = BusTransfer(0, 100, "I2C2", 0x6B, "", "", b"", b"", "bus error")
    assert waves.i2c(broken, "SCL", "SDA") is None


@pytest.mark.parametrize("kind", [VcdFile, PerfettoFile])
def test_too_large_file_ends_run(kind: Any, tmp_path: Path) -> None:
    board = Board(firmware="lab3")
    file = kind(board, tmp_path / "large", 20_000)
    with contextlib.suppress(OutputError):  # here, or when the rest is written
        board.run_for(3)
    with pytest.raises(OutputError, match=r"has reached 20000 bytes; .* --limit trace_bytes=NUMBER$"):
        file.close()
    assert (tmp_path / "large").stat().st_size <= 20_000


@pytest.mark.parametrize("kind", [VcdFile, PerfettoFile])
def test_unwritable_path_is_refused(kind: Any, tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="give a writable path"):
        kind(Board(), tmp_path / "missing" / "file")


# -- the time line ------------------------------------------------------------------------------------------


def time_line(tmp_path: Path, firmware: str) -> tuple[Board, list[dict[str, Any]]]:
    board = Board(firmware=firmware)
    board.trace.record_all()
    path = tmp_path / "run.json"
    with contextlib.closing(PerfettoFile(board, path)):
        board.run_for(1.2)
    found = json.loads(path.read_text(encoding="ascii"))
    assert found["displayTimeUnit"] in ("ms", "ns")
    return board, found["traceEvents"]


REQUIRED = {
    "X": {"name", "pid", "tid", "ts", "dur"},
    "i": {"name", "pid", "tid", "ts", "s"},
    "C": {"name", "pid", "ts", "args"},
    "M": {"name", "pid", "args"},
}
"""Keys that "Trace Event Format" requires for each phase."""


@pytest.mark.parametrize("firmware", ["solution", "lab3"])
def test_time_line_is_well_formed(firmware: str, tmp_path: Path) -> None:
    _, events = time_line(tmp_path, firmware)
    assert {event["ph"] for event in events} >= {"X", "C", "M"}
    for event in events:
        assert REQUIRED[event["ph"]] <= event.keys(), event
    for row in {event["tid"] for event in events if event["ph"] == "X"}:
        spans = sorted(
            ((one["ts"], -one["dur"]) for one in events if one["ph"] == "X" and one["tid"] == row),
        )
        ends: list[float] = []  # of the spans that contain this one
        for begin, minus in spans:
            while ends and ends[-1] <= begin + 1e-3:
                ends.pop()
            assert not ends or begin - minus <= ends[-1] + 1e-3, "a span reaches out of the one around it"
            ends.append(begin - minus)


def test_time_line_has_transfers_and_text(tmp_path: Path) -> None:
    board, events = time_line(tmp_path, "solution")
    rows = {event["args"]["name"]: event["tid"] for event in events if event["name"] == "thread_name"}
    shown = [one for one in events if one["ph"] == "X" and one["tid"] == rows["I2C2"]]
    expected = board.trace.of(BusTransfer)
    assert [(one["name"], one["ts"], one["args"]["read"]) for one in shown] == [
        (f"{one.device} {one.register}", one.t_ps / 1e6, one.read.hex(" ")) for one in expected
    ]
    printed = sum(
        one["args"]["bytes"] for one in events if one.get("tid") == rows["USART1"] and one["ph"] == "X"
    )
    assert printed == sum(len(one.data) for one in board.trace.of(TerminalBytes))


def test_time_line_shows_functions_in_their_callers(tmp_path: Path) -> None:
    _, events = time_line(tmp_path, "solution")
    calls = [one for one in events if one["ph"] == "X" and one["tid"] == 1]
    inner = [one for one in calls if one["name"] == "HAL_TIM_PeriodElapsedCallback"]
    assert len(inner) > 50
    assert sum(one["dur"] for one in calls if one["name"] == "main") > 0.9 * 1_200_000
    load = [one["args"]["TIM9 %"] for one in events if one["name"] == "callback"]
    late = sum(one["dur"] for one in inner if one["ts"] >= 1_100_000) / 100_000
    assert late == pytest.approx(sum(load[-5:]) / 500, abs=0.05)


# -- the picture --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("record")
    fcu("fcu run lab3 --scenario led_x --json run.json -q", folder)
    return folder / "run.json"


def test_record_has_printed_values_with_truth(record: Path) -> None:
    found = json.loads(record.read_text(encoding="utf-8"))
    angles = [one for one in found["printed"] if one["label"].startswith("Pitch")]
    last = angles[-1]
    low, high = last["truth"]["Pitch"]
    assert low - 1 <= last["values"]["Pitch"] <= high + 1
    assert any(led1 for _, led1, _ in found["leds"])


def test_record_is_drawn_as_picture(record: Path) -> None:
    done = fcu("fcu plot run.json", record.parent)
    picture = (record.parent / "run.png").read_bytes()
    assert done.stderr == "fcu: saved in run.png\n"
    assert picture.startswith(b"\x89PNG")
    assert min(struct.unpack(">II", picture[16:24])) > 1000


def test_picture_has_labels_for_its_contents(record: Path, tmp_path: Path) -> None:
    draw(json.loads(record.read_text(encoding="utf-8")), tmp_path / "run.svg")
    picture = (tmp_path / "run.svg").read_text(encoding="utf-8")
    for text in ("angles, deg", "Pitch", "LED2", "led_x", "virtual time, s", "printed"):
        assert text in picture
    assert picture.count("<!-- true value (") == 1


UNFIT = ["Infinity", "NaN", "1" + "0" * 400]
"""Numbers in JSON that are not valid times."""


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("", "no_json"),
        ("[1]", "no_record"),
        ("[" * 100_000, "no_json"),
        ('{"printed": []}', "nothing_to_draw"),
        ('{"printed": [1]}', "damaged"),
        ('{"printed": [{"label": "x", "values": {"a": "b"}, "at_s": 0, "truth": {}}]}', "damaged"),
        *((f'{{"printed": [], "virtual_s": {one}}}', "damaged") for one in UNFIT),
        ('{"printed": [], "leds": [[1' + "0" * 400 + ", true]]}", "damaged"),
    ],
)
def test_invalid_record_is_refused_in_one_line(tmp_path: Path, text: str, kind: str) -> None:
    (tmp_path / "run.json").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        draw_record(tmp_path / "run.json", None)
    assert caught.value.kind == kind
    assert "\n" not in str(caught.value)


def test_unknown_picture_type_error_lists_known_types(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.png, \.svg, \.pdf$") as refused:
        draw({"printed": []}, tmp_path / "run.gif")
    assert refused.value.kind == "picture_type"


def test_run_command_writes_vcd_and_perfetto_files(tmp_path: Path) -> None:
    done = fcu("fcu run lab3 --duration 300ms --speed max --vcd a.vcd --perfetto a.json", tmp_path)
    assert done.returncode == 0
    assert "$enddefinitions" in (tmp_path / "a.vcd").read_text(encoding="ascii")
    assert json.loads((tmp_path / "a.json").read_text(encoding="ascii"))["traceEvents"]
