/* SPI1 to SPI3 as master (RM0368 sections 20.3, 20.5).
 *
 * A byte takes eight periods of SCK. The end of a byte is a deferred event, or a scheduled event if an
 * interrupt or DMA waits for the byte. Then spi_line.c exchanges the byte. Directions: full duplex; one line
 * as output (BIDIMODE, BIDIOE); one line as input (BIDIMODE); receive-only (RXONLY). In the latter two
 * directions SPE starts the clock. With one line as input, BSY stays low (20.3.7).
 *
 * Decision: when an SPI only receives, its first byte starts when SPE is set. Each further byte starts when DR is read
 * while SPE is still set. So firmware that sets and clears SPE gets exactly one byte, as ST's sensor driver expects,
 * however many cycles an instruction takes. On the chip the clock does not wait for a read of DR. The overrun after a
 * long pulse is not modelled, because instruction timing is an estimate. If firmware sees RXNE, waits for one period
 * of SCK or longer and then clears SPE, the next byte has begun and is the last one (20.3.8).
 *
 * A master with SSM = 1 and SSI = 0 gets MODF.
 *
 * NOT MODELLED, with notes: slave mode; CRC (RXCRCR, TXCRCR read 0); TI mode; I2S; NSS as input (high) or output.
 */
#include "peripherals/spi.h"

#include "chip.h"
#include "generated/registers_spi.h"

#define CLOCK_BITS (CR1_BR | CR1_CPOL | CR1_CPHA)
#define EVENT_ENABLES (CR2_RXDMAEN | CR2_TXDMAEN | CR2_ERRIE | CR2_RXNEIE | CR2_TXEIE)
#define MASTER_ENABLED (CR1_SPE | CR1_MSTR)

enum Note { NOTE_CRC, NOTE_TI, NOTE_I2S, NOTE_MODF, NOTE_SLAVE, NOTE_NSS, NOTE_LOST, NOTE_PINS };

/* Interrupts: table 38. Pins: the board's pins. Functions of the pins: STM32F401xB/C datasheet table 9. */
static const struct {
  uint32_t base;
  int number;
  enum Request rx, tx;
  PinFunction pins[3];
} SPI[SPIS] = {
  {SPI1_BASE, 35, REQUEST_SPI1_RX, REQUEST_SPI1_TX, {{0, 0, 255}}},
  {SPI2_BASE, 36, REQUEST_SPI2_RX, REQUEST_SPI2_TX, {{'B', 13, 5}, {'B', 15, 5}, {0, 0, 255}}},
  {SPI3_BASE, 51, REQUEST_SPI3_RX, REQUEST_SPI3_TX, {{0, 0, 255}}},
};

static void serve_dma(Spi *spi) {
  Chip *chip = spi->peripheral.chip;
  if (spi->cr2 & CR2_RXDMAEN && spi->sr & SR_RXNE) {
    dma_request(chip, SPI[spi->number].rx);
  }
  for (int n = 0; n < 2; n++) {
    if (spi->cr2 & CR2_TXDMAEN && spi->sr & SR_TXE) {
      dma_request(chip, SPI[spi->number].tx);
    }
  }
}

static void update(Spi *spi) {
  if (spi->in_dma) {
    return;
  }
  spi->in_dma = true;
  serve_dma(spi);
  spi->in_dma = false;
  uint32_t causes = (spi->cr2 & CR2_TXEIE ? SR_TXE : 0) | (spi->cr2 & CR2_RXNEIE ? SR_RXNE : 0);
  causes |= spi->cr2 & CR2_ERRIE ? SR_OVR | SR_MODF : 0;
  peripheral_set_irq(&spi->peripheral, SPI[spi->number].number, spi->sr & causes);
}

static void update_if_enabled(Spi *spi) {
  if (spi->wants_events) {
    update(spi);
  }
}

/* Return true if SPE starts the clock. */
static bool is_receiving(uint32_t cr1) { return cr1 & CR1_BIDIMODE ? !(cr1 & CR1_BIDIOE) : cr1 & CR1_RXONLY; }

static void schedule_end(Spi *spi, int64_t at_ps) {
  (spi->wants_events ? event_schedule : event_defer)(spi->peripheral.chip, spi->event, at_ps);
}

static void start(Spi *spi, int32_t value) {
  spi->shift = value;
  spi->is_busy = true;
  if (value != SPI_NOTHING || !(spi->cr1 & CR1_BIDIMODE)) {
    spi->sr |= SR_BSY;
  }
  if (spi->byte_ps < NEVER_PS) {
    schedule_end(spi, spi->peripheral.chip->now_ps + spi->byte_ps * (spi->cr1 & CR1_DFF ? 2 : 1));
  }
}

static void start_next(Spi *spi, bool began) {
  if ((spi->cr1 & MASTER_ENABLED) != MASTER_ENABLED) {
    return;
  }
  if (is_receiving(spi->cr1)) {
    if (began) {
      start(spi, SPI_NOTHING);
    }
  } else if (!(spi->sr & SR_TXE)) {
    spi->sr |= SR_TXE;
    start(spi, (int32_t)spi->to_send);
  }
}

static uint8_t reversed(uint8_t byte) {
  uint8_t result = 0;
  for (int bit = 0; bit < 8; bit++) {
    result = (uint8_t)(result << 1 | (byte >> bit & 1));
  }
  return result;
}

/* out may be SPI_NOTHING. */
static uint8_t transfer_byte(Spi *spi, int32_t out) {
  if (!spi->is_connected) {
    return SPI_UNDRIVEN;
  }
  uint8_t sent = out == SPI_NOTHING ? SPI_UNDRIVEN : (uint8_t)out, answer;
  if (out != SPI_NOTHING && spi->cr1 & CR1_LSBFIRST) {
    sent = reversed(sent);
  }
  if (!(spi->cr1 & CR1_BIDIMODE)) {
    answer = spi_line_exchange(spi, sent);
  } else if (out == SPI_NOTHING) {
    answer = spi_line_receive(spi);
  } else {
    spi_line_send(spi, sent);
    return SPI_UNDRIVEN;
  }
  return spi->cr1 & CR1_LSBFIRST ? reversed(answer) : answer;
}

/* SPE of a receiving SPI was cleared: finish the last byte if it has begun. */
static void finish_receiving(Spi *spi) {
  int64_t now_ps = spi->peripheral.chip->now_ps, frame_ps = spi->byte_ps * (spi->cr1 & CR1_DFF ? 2 : 1);
  bool began = spi->received_seen && spi->sr & SR_RXNE && now_ps - spi->received_ps >= spi->byte_ps / 8;
  if (began && !spi->is_busy && spi->byte_ps < NEVER_PS) {
    start(spi, SPI_NOTHING);
    schedule_end(spi, spi->received_ps + frame_ps);
  }
}

/* Most significant byte first. */
static uint32_t transfer_frame(Spi *spi) {
  uint32_t frame = 0;
  for (int shift = spi->cr1 & CR1_DFF ? 8 : 0; shift >= 0; shift -= 8) {
    int32_t out = spi->shift == SPI_NOTHING ? SPI_NOTHING : spi->shift >> shift & 0xFF;
    frame = frame << 8 | transfer_byte(spi, out);
  }
  return frame;
}

static void store(Spi *spi, uint32_t frame) {
  if (spi->sr & SR_RXNE) {
    spi->sr |= SR_OVR;
    spi->data_read = false;
  } else {
    spi->received = frame;
    spi->sr |= SR_RXNE;
    spi->received_seen = false;
    spi->received_ps = spi->peripheral.chip->now_ps;
  }
}

static void end_frame(Peripheral *peripheral) {
  Spi *spi = (Spi *)peripheral;
  spi->active_ps = peripheral->chip->now_ps;
  spi->is_busy = false;
  bool listens = spi->shift == SPI_NOTHING || !(spi->cr1 & CR1_BIDIMODE);
  uint32_t frame = transfer_frame(spi);
  spi->sr &= ~(uint32_t)SR_BSY;
  if (listens) {
    store(spi, frame);
  }
  start_next(spi, false);
  update_if_enabled(spi);
}

static void write_data(Spi *spi, uint32_t value) {
  if (!(spi->sr & SR_TXE)) {
    peripheral_note(&spi->peripheral, NOTE_LOST, NOTE_FORBIDDEN,
                    "data-lost | DR written while TXE was 0: the frame that waited there is lost");
  }
  spi->to_send = value;
  spi->sr &= ~(uint32_t)SR_TXE;
  if (!spi->is_busy) {
    start_next(spi, false);
  }
}

static uint32_t read_data(Spi *spi) {
  uint32_t frame = spi->received;
  spi->sr &= ~(uint32_t)SR_RXNE;
  spi->data_read = true;
  if (!spi->is_busy && is_receiving(spi->cr1)) {
    start_next(spi, true);
  }
  update_if_enabled(spi);
  return frame;
}

/* BR, CPOL, CPHA (20.5.1). */
static void set_clock(Spi *spi) {
  const Clocks *clocks = &spi->peripheral.chip->clocks;
  int64_t kernel_hz = spi->number == 0 ? clocks->pclk2_hz : clocks->pclk1_hz;
  int64_t divider = INT64_C(2) << (spi->cr1 >> 3 & 7);
  spi->configured_cr1 = spi->cr1 & CR1_SPE ? (int32_t)(spi->cr1 & CLOCK_BITS) : SPI_NOTHING;
  spi->byte_ps = kernel_hz > 0 ? 8 * divider * PS_PER_S / kernel_hz : NEVER_PS;
  if (spi->cr1 & CR1_SPE) {
    spi_line_configure(spi, (int32_t)(kernel_hz / divider), spi->cr1 & (CR1_CPOL | CR1_CPHA));
  }
}

static void check_pins(Spi *spi) {
  char missing[80];
  const PinFunction *pins = SPI[spi->number].pins;
  spi->is_connected = pins_connected(spi->peripheral.chip, pins, missing, sizeof missing);
  if (!spi->is_connected) {
    peripheral_note(&spi->peripheral, -1, NOTE_FORBIDDEN,
                    "pins-not-switched | no part can answer before the pins are switched: %s", missing);
  }
}

static void check_enable(Spi *spi) {
  if (!(spi->cr1 & CR1_MSTR)) {
    peripheral_note(&spi->peripheral, NOTE_SLAVE, NOTE_NOT_MODELLED,
                    "slave-mode | slave mode: SPE set with MSTR = 0, but the board has no other master");
  } else if (!(spi->cr1 & CR1_SSM) && !(spi->cr2 & CR2_SSOE)) {
    peripheral_note(&spi->peripheral, NOTE_NSS, NOTE_NOT_MODELLED,
                    "nss-input | NSS as input (SSM = 0, SSOE = 0); the emulator treats NSS as high");
  }
  check_pins(spi);
}

static void cr1_changed(Spi *spi, uint32_t old) {
  if (spi->cr1 & CR1_CRCEN) {
    peripheral_note(&spi->peripheral, NOTE_CRC, NOTE_NOT_MODELLED, "crc | CRCEN (CRC calculation)");
  }
  if (spi->modf_seen) {
    spi->sr &= ~(uint32_t)SR_MODF;
    spi->modf_seen = false;
  }
  if (spi->cr1 & CR1_MSTR && spi->cr1 & CR1_SSM && !(spi->cr1 & CR1_SSI)) {
    spi->sr |= SR_MODF;
    spi->cr1 &= ~(uint32_t)MASTER_ENABLED;
    peripheral_note(&spi->peripheral, NOTE_MODF, NOTE_FORBIDDEN,
                    "mode-fault | master with SSM = 1 and SSI = 0: mode fault (MODF), SPE and MSTR cleared");
  }
  if (!(spi->cr1 & CR1_SPE)) {
    if ((old & MASTER_ENABLED) == MASTER_ENABLED && is_receiving(old)) {
      finish_receiving(spi);
    }
    return;
  }
  if ((int32_t)(spi->cr1 & CLOCK_BITS) != spi->configured_cr1) {
    set_clock(spi);
  }
  if (!(old & CR1_SPE)) {
    check_enable(spi);
  }
  if (!spi->is_busy) {
    start_next(spi, !(old & CR1_SPE) || !is_receiving(old));
  }
}

static void cr2_changed(Spi *spi) {
  if (spi->cr2 & CR2_FRF) {
    peripheral_note(&spi->peripheral, NOTE_TI, NOTE_NOT_MODELLED, "ti-mode | FRF (TI mode)");
  }
  spi->wants_events = (spi->cr2 & EVENT_ENABLES) != 0;
  int64_t end_ps = event_at(spi->peripheral.chip, spi->event);
  if (end_ps < NEVER_PS) {
    schedule_end(spi, end_ps);
  }
  update(spi);
}

static uint32_t spi_peek(const Peripheral *peripheral, uint32_t offset) {
  const Spi *spi = (const Spi *)peripheral;
  switch (offset) {
    case CR1: return spi->cr1;
    case CR2: return spi->cr2;
    case SR: return spi->sr;
    case DR: return spi->received;
    case CRCPR: return spi->crcpr;
    case I2SCFGR: return spi->i2scfgr;
    case I2SPR: return spi->i2spr;
    default: return 0;
  }
}

/* A read of DR and then SR clears OVR. A read of SR and then a write of CR1 clears MODF (20.3.10). */
static uint32_t read_status(Spi *spi, int64_t *until_ps) {
  uint32_t status = spi->sr;
  *until_ps = event_at(spi->peripheral.chip, spi->event);
  spi->received_seen |= (status & SR_RXNE) != 0;
  if (status & (SR_OVR | SR_MODF)) {
    *until_ps = NOT_CACHEABLE_PS;
    if (spi->data_read) {
      spi->sr &= ~(uint32_t)SR_OVR;
    }
    spi->modf_seen = (status & SR_MODF) != 0;
    update_if_enabled(spi);
  }
  return status;
}

static bool spi_is_pure(const Peripheral *peripheral, uint32_t offset) {
  const Spi *spi = (const Spi *)peripheral;
  return offset != DR && !(offset == SR && spi->sr & SR_OVR && spi->data_read);
}

static uint32_t spi_read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  if (offset == SR) {
    return read_status((Spi *)peripheral, until_ps);
  }
  if (offset == DR) {
    *until_ps = NOT_CACHEABLE_PS;
    return read_data((Spi *)peripheral);
  }
  return spi_peek(peripheral, offset);
}

static void spi_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Spi *spi = (Spi *)peripheral;
  uint32_t old = spi->cr1;
  spi->active_ps = peripheral->chip->now_ps;
  switch (offset) {
    case CR1:
      write_bits(&spi->cr1, value, mask, CR1_STORED);
      cr1_changed(spi, old);
      break;
    case CR2:
      write_bits(&spi->cr2, value, mask, CR2_STORED);
      cr2_changed(spi);
      break;
    case DR: write_data(spi, value & (spi->cr1 & CR1_DFF ? 0xFFFF : 0xFF)); break;
    case CRCPR: write_bits(&spi->crcpr, value, mask, CRCPR_STORED); break;
    case I2SCFGR:
      write_bits(&spi->i2scfgr, value, mask, I2SCFGR_STORED);
      if (spi->i2scfgr & I2SCFGR_I2SMOD) {
        peripheral_note(peripheral, NOTE_I2S, NOTE_NOT_MODELLED, "i2s | I2SMOD (I2S mode)");
      }
      break;
    case I2SPR: write_bits(&spi->i2spr, value, mask, I2SPR_STORED); break;
    default: break;
  }
  update_if_enabled(spi);
}

/* A frame in progress is lost. */
static void spi_reset(Peripheral *peripheral) {
  Spi *spi = (Spi *)peripheral;
  event_cancel(peripheral->chip, spi->event);
  spi->cr1 = spi->cr2 = spi->i2scfgr = spi->to_send = spi->received = 0;
  spi->sr = SR_RESET;
  spi->crcpr = CRCPR_RESET;
  spi->i2spr = I2SPR_RESET;
  spi->shift = 0;
  spi->is_busy = spi->data_read = spi->modf_seen = spi->received_seen = spi->in_dma = spi->wants_events = false;
  spi->is_connected = true;
  spi->configured_cr1 = SPI_NOTHING;
  spi->byte_ps = NEVER_PS;
  update(spi);
}

static void spi_clocks_changed(Peripheral *peripheral) { set_clock((Spi *)peripheral); }

static void spi_dma_ready(Peripheral *peripheral) { update((Spi *)peripheral); }

static const PeripheralType TYPE = {
  .read = spi_read,
  .peek = spi_peek,
  .write = spi_write,
  .reset = spi_reset,
  .is_pure = spi_is_pure,
  .clocks_changed = spi_clocks_changed,
  .dma_ready = spi_dma_ready,
};

void spi_create(Chip *chip) {
  for (uint32_t n = 0; n < SPIS; n++) {
    Spi *spi = &chip->spi[n];
    peripheral_create(chip, &spi->peripheral, &TYPE, SPI[n].base, SPI1_SIZE, SPI_OFFSETS);
    spi->number = n;
    spi->event = event_create(&spi->peripheral, end_frame);
    dma_connect(&spi->peripheral, SPI[n].rx);
    dma_connect(&spi->peripheral, SPI[n].tx);
    spi_line_create(&spi->line);
    spi_reset(&spi->peripheral);
  }
}
