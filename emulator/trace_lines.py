"""Events as lines of a JSON-lines file.

A line has the time in seconds as an exact decimal string, the kind, and the event's fields in their order,
bytes in hexadecimal. Lines are put together from the fields' own texts: 3,200 bus transfers a second of
virtual time would cost more through a general encoder than the run itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import lru_cache
from json.encoder import encode_basestring_ascii as quoted
from typing import Any

from emulator.trace_events import BusTransfer, TraceEvent


def line(event: TraceEvent) -> str:
    """The event as a line, its end included."""
    if isinstance(event, BusTransfer):
        return transfer_line(
            event.t_ps,
            event.end_ps,
            event.bus,
            event.address,
            event.device,
            event.register,
            event.written,
            event.read,
            event.result,
        )
    texts = [f'"t_s":{_seconds(event.t_ps)}', f'"kind":{quoted(event.kind)}']
    for name in _NAMES[type(event)]:
        value = getattr(event, name)
        texts.append(f'"{name}":{_TEXTS[type(value)](value)}')
    return f"{{{','.join(texts)}}}\n"


def transfer_line(
    t_ps: int,
    end_ps: int,
    bus: str,
    address: int,
    device: str,
    register: str,
    written: bytes,
    read: bytes,
    result: str,
) -> str:
    """The line of a :class:`BusTransfer` with these fields."""
    begin, end = _of_transfers(bus, address, device, register, written, result)
    return f'{{"t_s":{_seconds(t_ps)},"kind":"bus","end_ps":{end_ps},{begin},"read":"{read.hex()}",{end}}}\n'


@lru_cache(maxsize=1024)
def _of_transfers(
    bus: str, address: int, device: str, register: str, written: bytes, result: str
) -> tuple[str, str]:
    """What lines of the same transfer have in common: before and after the bytes read."""
    begin = (
        f'"bus":{quoted(bus)},"address":{address},"device":{quoted(device)},'
        f'"register":{quoted(register)},"written":"{written.hex()}"'
    )
    return begin, f'"result":{quoted(result)}'


def _seconds(t_ps: int) -> str:
    digits = f"{t_ps:013d}"
    return f'"{digits[:-12]}.{digits[-12:]}"'


def _hexadecimal(value: bytes) -> str:
    return f'"{value.hex()}"'


_TEXTS: dict[type, Callable[[Any], str]] = {
    int: str,
    str: quoted,
    bytes: _hexadecimal,
    bytearray: _hexadecimal,
}
_NAMES = {
    kind: tuple(field.name for field in fields(kind) if field.name != "t_ps")
    for kind in TraceEvent.__subclasses__()
}
