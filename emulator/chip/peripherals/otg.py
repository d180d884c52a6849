"""OTG_FS without a cable (RM0368 section 22.16).

Firmware can reset and configure the core of OTG_FS. Transmit FIFOs stay empty, and no interrupt
occurs.

NOT MODELLED, with a note: everything that needs a connected host or device.
"""

from __future__ import annotations

from fcu_emulator.emulator.chip.peripherals.peripheral import WORD, Peripheral, Soc

GOTGCTL, GUSBCFG, GRSTCTL, GINTSTS, GRXFSIZ = 0x00, 0x0C, 0x10, 0x14, 0x24
DIEPTXF0, GNPTXSTS, CID, HPTXFSIZ, DIEPTXF1 = 0x28, 0x2C, 0x3C, 0x100, 0x104
HFIR, HFNUM, HPTXSTS = 0x404, 0x408, 0x410
DCFG, DSTS, DVBUSDIS, DVBUSPULSE = 0x800, 0x808, 0x828, 0x82C
_ENDPOINTS, _ENDPOINT_STEP = 4, 0x20
DIEPCTL, DIEPINT, DTXFSTS, DOEPCTL, DOEPINT = 0x900, 0x908, 0x918, 0xB00, 0xB08  # of endpoint 0
_FIFOS = range(0x1000, 0x2_0000)

_CONNECTOR_ID, _B_DEVICE = GOTGCTL, 1 << 16
_FORCE_HOST, _HOST_MODE = 1 << 29, 1 << 0
_AHB_IDLE, _CORE_RESET = 1 << 31, 1 << 0
_FIFO_EMPTY, _FIFO_WORDS, _ACTIVE_ENDPOINT = 1 << 7, 0x200, 1 << 15

_RESETS = {
    _CONNECTOR_ID: _B_DEVICE,
    GUSBCFG: 0x0A00,
    GRSTCTL: _AHB_IDLE,
    GINTSTS: 0x0400_0020,
    GRXFSIZ: 0x200,
    DIEPTXF0: 0x200,
    GNPTXSTS: 0x0008_0200,
    CID: 0x1000,
    HPTXFSIZ: 0x0200_0600,
    **{DIEPTXF1 + 4 * number: 0x0200_0400 for number in range(_ENDPOINTS - 1)},
    HFIR: 0xEA60,
    HFNUM: 0x3FFF,
    HPTXSTS: 0x0008_0100,
    DCFG: 0x0220_0000,
    DSTS: 0x10,
    DVBUSDIS: 0x17D7,
    DVBUSPULSE: 0x05B8,
    DIEPCTL: _ACTIVE_ENDPOINT,
    DOEPCTL: _ACTIVE_ENDPOINT,
} | {
    first + _ENDPOINT_STEP * number: value
    for number in range(_ENDPOINTS)
    for first, value in ((DIEPINT, _FIFO_EMPTY), (DTXFSTS, _FIFO_WORDS), (DOEPINT, _FIFO_EMPTY))
}
_READ_ONLY = frozenset((_CONNECTOR_ID, GRSTCTL, GINTSTS, GNPTXSTS, HFNUM, HPTXSTS, DSTS)) | {
    first + _ENDPOINT_STEP * number for number in range(_ENDPOINTS) for first in (DIEPINT, DTXFSTS, DOEPINT)
}


class OtgFs(Peripheral):
    """The controller's registers. Registers without status bits keep the values that firmware writes."""

    def __init__(self, soc: Soc, name: str, base: int, size: int) -> None:
        super().__init__(soc, name, base, size)
        self._words = dict(_RESETS)

    def reset(self) -> None:
        self._words = dict(_RESETS)

    def peek(self, offset: int) -> int:
        return self._words.get(offset, 0)

    def read(self, offset: int) -> int:
        return self._words.get(offset, 0)

    def write(self, offset: int, value: int, mask: int = WORD) -> None:
        self.note("not modelled", "no-cable", "no USB cable is connected: a host never finds the device")
        value &= mask
        if offset == GRSTCTL:
            if value & _CORE_RESET:  # this bit and the flush bits clear themselves immediately
                self.reset()
        elif offset not in _READ_ONLY and offset not in _FIFOS:
            self._words[offset] = self._words.get(offset, 0) & ~mask | value
        if offset == GUSBCFG:
            mode = _HOST_MODE if self._words[GUSBCFG] & _FORCE_HOST else 0
            self._words[GINTSTS] = self._words[GINTSTS] & ~_HOST_MODE | mode
