"""The trace: its recipients, and lines that equal those of a general JSON encoder."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fcu_emulator import Board
from fcu_emulator.emulator.errors import LinkError, OutputError
from fcu_emulator.emulator.trace import BusTransfer, Fault, GpioEdge, TerminalBytes, Trace, TraceEvent, line

PS_PER_S = 10**12
VALUES: dict[str, st.SearchStrategy[object]] = {
    "int": st.integers(0, 1 << 62),
    "str": st.text() | st.sampled_from(['"', "\\", "\n\r\t\x00\x7f", "°C", "\u2028", "\U0001f600", "\ud800"]),
    "bytes": st.binary(max_size=40),
    "Mapping[str, NoteValue]": st.dictionaries(
        st.text(), st.integers() | st.floats(allow_nan=False) | st.text(), max_size=4
    ),
}


def events(kind: type[TraceEvent]) -> st.SearchStrategy[TraceEvent]:
    return st.builds(kind, **{field.name: VALUES[str(field.type)] for field in dataclasses.fields(kind)})


def as_json(event: TraceEvent) -> str:
    """Return the contents of the files as the standard library's encoder writes them."""
    shown: dict[str, object] = {}
    for name, value in dataclasses.asdict(event).items():
        if name.endswith("_ps"):
            shown[f"{name[:-3]}_s"] = f"{value // PS_PER_S}.{value % PS_PER_S:012d}"
        else:
            shown[name] = value.hex() if isinstance(value, bytes) else value
    return json.dumps({"t_s": shown.pop("t_s"), "kind": event.kind, **shown}, separators=(",", ":")) + "\n"


@pytest.mark.parametrize("kind", TraceEvent.__subclasses__(), ids=lambda kind: kind.__name__)
@given(data=st.data())
def test_trace_line_equals_that_of_json_encoder(kind: type[TraceEvent], data: st.DataObject) -> None:
    event = data.draw(events(kind))
    assert line(event) == as_json(event)


def test_lab_run_is_written_as_json(tmp_path: Path) -> None:
    """Files, memory and subscribers get the same events in the same order."""
    board, heard = Board(firmware="lab3"), []
    board.trace.write_to(tmp_path / "files_only.jsonl")
    board.run_for(1.2)
    assert not board.trace.of(BusTransfer)
    board.trace.close()
    again = Board(firmware="lab3")
    again.trace.record_all()
    again.trace.subscribe(heard.append)
    again.trace.write_to(tmp_path / "one.jsonl")
    again.trace.write_to(tmp_path / "two.jsonl")
    again.run_for(1.2)
    again.trace.close()

    lines = [(tmp_path / name).read_text() for name in ("files_only.jsonl", "one.jsonl", "two.jsonl")]
    assert lines[0] == lines[1] == lines[2] == "".join(map(as_json, again.trace))
    assert heard == list(again.trace)
    assert len(again.trace.of(BusTransfer)) > 100


def test_trace_without_subscribers_is_not_detailed(tmp_path: Path) -> None:
    trace = Trace()
    assert not trace.detailed
    first, second = trace.subscribe(lambda _: None), trace.subscribe(lambda _: None, detail=False)
    assert trace.detailed
    first()
    assert not trace.detailed
    first()  # harmless
    second()
    trace.write_to(tmp_path / "trace.jsonl")
    assert trace.detailed
    trace.close()
    assert not trace.detailed


def test_subscriber_gets_requested_events() -> None:
    trace, everything, rare = Trace(), [], []
    trace.subscribe(everything.append)
    end = trace.subscribe(rare.append, detail=False)
    edge, text = GpioEdge(1, "PB5", 0), TerminalBytes(2, "tx", b"a")
    trace.add(edge)
    trace.add_detail(text)
    trace.add_transfer(3, 4, "I2C2", 0x6B, "LSM6DSL", "WHO_AM_I", b"\x0f", b"\x6a", "ok")
    trace.add_transfer(5, 6, "I2C2", 0x6B, "", "", b"", b"", "no acknowledge")
    end()
    trace.add(Fault(7, "core", "stopped"))

    failed = BusTransfer(5, 6, "I2C2", 0x6B, "", "", b"", b"", "no acknowledge")
    assert [type(event) for event in everything] == [GpioEdge, TerminalBytes, BusTransfer, BusTransfer, Fault]
    assert rare == [edge, failed]
    assert list(trace) == [edge, failed, Fault(7, "core", "stopped")]


def test_subscriber_may_unsubscribe_when_called() -> None:
    trace, heard = Trace(), []

    def once(event: TraceEvent) -> None:
        heard.append(event)
        end()

    end = trace.subscribe(once)
    trace.add(Fault(1, "core", "first"))
    trace.add(Fault(2, "core", "second"))
    assert [event.t_ps for event in heard] == [1]


def test_error_shows_file_that_cannot_be_opened() -> None:
    with pytest.raises(LinkError, match=r"trace file /nowhere/trace\.jsonl"):
        Trace().write_to("/nowhere/trace.jsonl")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="/dev/full is a Linux device")
def test_full_disk_ends_run_and_file() -> None:
    board = Board(firmware="lab3")
    board.trace.write_to("/dev/full")
    with pytest.raises(OutputError, match="No space left"):
        board.run_for(10)
    assert not board.trace.detailed
    board.trace.close()
