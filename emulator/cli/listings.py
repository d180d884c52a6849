"""Commands that print register maps, scenarios and schemas."""

from __future__ import annotations

import json
from collections.abc import Iterator

import click

from fcu_emulator.emulator.analysis.fidelity import chip_table, table, without_behaviour
from fcu_emulator.emulator.chip.registers import DECLARED, address_of
from fcu_emulator.emulator.chip.registers.declaration import DeclaredPeripheral, Field, PeripheralRegister
from fcu_emulator.emulator.errors import InputError
from fcu_emulator.emulator.scenario import json_schema, load_scenario, scenario_names
from fcu_emulator.emulator.text import visible
from fcu_emulator.sensors import SENSORS, Sensor
from fcu_emulator.sensors.declaration import Bus
from fcu_emulator.sensors.errors import Figure
from fcu_emulator.sensors.register import Bits, Register, RegisterMap

# -- Register maps of the sensors and of the chip's peripherals, as declared -------------------------------------


_ACCESS = {"rw": "RW", "r": "R ", "w": " W"}


def print_fidelity() -> None:
    """Print the modelled features as Markdown tables."""
    click.echo(f"{table()}\n\n{chip_table()}")


def print_registers(name: str | None) -> None:
    """Print the registers of a sensor or peripheral, or all registers with this name. Raises InputError."""
    wanted = (name or "").strip().upper()
    peripheral = next((one for own, one in DECLARED.items() if own.upper() == wanted), None)
    if wanted in SENSORS:
        _print_part(SENSORS[wanted])
    elif peripheral is not None:
        _print_peripheral(peripheral)
    elif found := list(_called(wanted)):
        click.echo("\n".join(found))
    else:
        parts, peripherals = ", ".join(SENSORS), ", ".join(DECLARED)
        raise InputError(
            f"unknown part {name or ''!r}; known: {parts}, {peripherals}, or the name of a register"
        )


def _called(wanted: str) -> Iterator[str]:
    for part in SENSORS.values():
        for title, bank in part.maps().items():
            for register in bank.registers:
                if register.__name__.upper() == wanted:
                    yield f"{part.NAME}{f', {title}' if title else ''}"
                    yield from _with_fields(register)
    for peripheral in DECLARED.values():
        for word in peripheral.registers:
            if word.name.upper() == wanted:
                yield peripheral.name
                yield _word_line(peripheral, word)
                yield from (_word_field_line(word, field) for field in word.fields())


def _print_part(part: type[Sensor]) -> None:
    names = without_behaviour(part)
    measured = (f"{quantity.doc} ({quantity.unit})" for quantity in part.SIGNALS)
    click.echo(f"{part.NAME} measures {', '.join(measured)}")
    click.echo("; ".join(_reached(part.BUS)))
    click.echo("\nregisters: address, access, reset value, name, meaning")
    click.echo(f"not modelled, reported when used: {', '.join(names) or 'nothing'}\n")
    for title, bank in part.maps().items():
        if title:
            click.echo(f"\n{title}\n")
        click.echo("\n".join(_lines(bank)))
    click.echo(f"\ndeviations of a real sensor: keys of [sensors.{part.NAME.lower()}] in a scenario:\n")
    click.echo("\n".join(_figure_line(name, figure) for name, figure in part.ERRORS.figures().items()))


def _reached(bus: Bus) -> list[str]:
    ways = []
    if bus.i2c_addresses:
        addresses = " or ".join(f"0x{address:02X}" for address in bus.i2c_addresses)
        ways.append(f"I2C at {addresses}, up to {bus.i2c_highest_hz // 1000} kHz")
    if bus.spi_wires:
        modes = " or ".join(map(str, bus.spi_modes))
        speed = bus.spi_highest_hz // 10**6
        ways.append(f"SPI in mode {modes}, {bus.spi_wires} wires after reset, up to {speed} MHz")
    return ways


def _figure_line(name: str, figure: Figure) -> str:
    axes = ", X, Y, Z" if figure.axes == 3 else ""
    return f"{name:<35}{figure.unit + axes:<24}{figure.size:<18}{figure.doc} ({figure.source})"


def _lines(bank: RegisterMap) -> list[str]:
    return [line for register in bank.registers for line in _with_fields(register)]


def _with_fields(register: type[Register]) -> Iterator[str]:
    yield _register_line(register)
    yield from (_field_line(bits, register) for bits in register.fields)


def _register_line(register: type[Register]) -> str:
    last = register.addr + register.size - 1
    address = f"0x{register.addr:02X}" + (f"-0x{last:02X}" if register.size > 1 else "")
    mark = "" if register.modelled else " (not modelled)"
    reset = f"0x{register.reset:0{2 * register.size}X}"
    return (
        f"{address:<10} {_ACCESS[register.access]} {reset:<8} {register.__name__}: {register.meaning()}{mark}"
    )


def _field_line(bits: Bits, register: type[Register]) -> str:
    where = f"{bits.msb}:{bits.lsb}" if bits.msb != bits.lsb else str(bits.msb)
    mark = "" if bits.modelled or not register.modelled else " (not modelled)"
    return f"{'':10}    {where:>5}     {bits.name}: {bits.doc}{mark}"


def _print_peripheral(peripheral: DeclaredPeripheral) -> None:
    names = peripheral.without_behaviour()
    click.echo(f"{peripheral.name}: {peripheral.title}")
    click.echo("registers: address, access, reset value, name, meaning")
    click.echo(f"not modelled: {', '.join(names) or 'nothing'}\n")
    for register in peripheral.registers:
        click.echo(_word_line(peripheral, register))
        for field in register.fields():
            click.echo(_word_field_line(register, field))


def _word_line(peripheral: DeclaredPeripheral, register: PeripheralRegister) -> str:
    kind = register.declared
    mark = "" if kind.modelled else " (not modelled)"
    address = address_of(peripheral.name, kind) - kind.addr + register.offset
    return f"0x{address:08X} {kind.access:<5} 0x{register.reset:08X} {register.name}: {kind.meaning()}{mark}"


def _word_field_line(register: PeripheralRegister, field: Field) -> str:
    where = f"{field.msb}:{field.lsb}" if field.msb != field.lsb else str(field.msb)
    mark = "" if field.bits.modelled or not register.declared.modelled else " (not modelled)"
    access = field.bits.access or register.declared.access
    return f"{where:>10} {access:<5}            {field.name}: {field.bits.doc}{mark}"


# -- Scenarios ----------------------------------------------------------------------------------------------


def list_scenarios() -> None:
    """Print shipped scenarios with their questions."""
    names = scenario_names()
    width = max(len(name) for name in names)
    for name, question in names.items():
        click.echo(f"{name:<{width}}  {question}")
    click.echo("\nRun one with: fcu run --scenario NAME")


def check_scenario(file: str) -> None:
    """Check a scenario. Raises ScenarioError, which names file and key."""
    plan = load_scenario(file)
    click.echo(visible(f"{file}: valid; {plan.question}"))


def print_schema() -> None:
    """Print the scenarios' JSON schema."""
    click.echo(json.dumps(json_schema(), indent=2))


# -- Rubrics ------------------------------------------------------------------------------------------------


def print_rubric_schema() -> None:
    """Print the rubrics' JSON schema."""
    from fcu_emulator.emulator.grading.rubric import json_schema as rubric_schema

    click.echo(json.dumps(rubric_schema(), indent=2))
