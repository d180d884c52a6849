"""What bank A says about the hub's four slaves (datasheet 11.2 to 11.15; AN5040 7.2)."""

from __future__ import annotations

from dataclasses import dataclass

from sensors.lsm6dsl.bank_a import (
    DATAWRITE_SRC_MODE_SUB_SLV0,
    SLAVE0_CONFIG,
    SLAVE1_CONFIG,
    SLV0_ADD,
    SLV0_SUBADD,
)
from sensors.lsm6dsl.hub_ironing import RAW_BYTES

OUTPUT_BYTES = 18  # SENSORHUB1 to SENSORHUB18
_BYTES_PER_SLAVE = 3  # address, sub-address, configuration: the same layout four times


@dataclass(frozen=True)
class Slave:
    """One slave that takes part in the rounds. ``place``: where its first byte goes in the outputs."""

    number: int
    address: int
    subaddress: int
    every: int  # triggers from one turn to the next
    length: int = 0  # bytes to read; 0 for the write
    place: int = 0


@dataclass(frozen=True)
class Plan:
    """All slaves in use, in the order of their turns, and slave 0's options."""

    slaves: tuple[Slave, ...]
    length: int  # bytes of output asked for
    data: int  # what slave 0 writes, or the register that its test reads
    write_once: bool
    tested: bool  # Src_mode: slave 0 is read only if the register ``data`` is not zero

    @property
    def reads_magnetometer(self) -> bool:
        """Whether slave 0 gives the six bytes that the correction needs."""
        return bool(self.slaves) and self.slaves[0].number == 0 and self.slaves[0].length == RAW_BYTES

    @classmethod
    def decode(cls, mem: bytearray) -> Plan:
        """Read the plan out of bank A. Slaves to be read fill the outputs one after the other."""
        config = mem[SLAVE0_CONFIG.addr]
        extra = SLAVE0_CONFIG.Aux_sens_on.get(config)
        slaves: list[Slave] = []
        place = 0
        for number in range(extra + 1):
            slave = _slave(mem, number, place)
            if slave is not None:
                slaves.append(slave)
                place += slave.length
        return cls(
            slaves=tuple(slaves),
            length=place,
            data=mem[DATAWRITE_SRC_MODE_SUB_SLV0.addr],
            # datasheet 11.8: only with more than one slave
            write_once=bool(extra and mem[SLAVE1_CONFIG.addr] & SLAVE1_CONFIG.write_once.mask),
            tested=bool(config & SLAVE0_CONFIG.Src_mode.mask),
        )


def _slave(mem: bytearray, number: int, place: int) -> Slave | None:
    """Slave ``number``; None if it has no turn: its reads are off, or it is to read nothing."""
    offset = _BYTES_PER_SLAVE * number
    config = mem[SLAVE0_CONFIG.addr + offset]
    reads = bool(mem[SLV0_ADD.addr + offset] & SLV0_ADD.rw_0.mask)
    length = SLAVE0_CONFIG.Slave0_numop.get(config) if reads else 0
    if not length and (reads or number):
        return None
    return Slave(
        number=number,
        address=SLV0_ADD.Slave0_add.get(mem[SLV0_ADD.addr + offset]),
        subaddress=mem[SLV0_SUBADD.addr + offset],
        every=1 << SLAVE0_CONFIG.Slave0_rate.get(config),
        length=length,
        place=place,
    )
