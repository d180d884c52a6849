/* I2C1 to I2C3 as bus master (RM0368 section 18).
 *
 * A message is a sequence of operations: start, address, bytes, stop (18.3.3, figures 163, 164). After each operation
 * STOP, START and DR select the next operation; without a request the peripheral holds SCL low. The end of an
 * operation is a scheduled event if an interrupt or DMA waits for it, otherwise a deferred event.
 *
 * The receiver has two stages, DR and shift register; when both are full (BTF), SCL stays low until DR is read. The
 * ACK bit is used at the end of a byte; if POS is set, the first byte uses the value that this bit had when the
 * address was sent. HAL reads two bytes this way. In this model SCL stays low after a byte without acknowledge, so
 * that a late STOP loses no byte. On the chip SCL is certain to stay low only while DR is full.
 *
 * TXE is set with ADDR after a transmitter's address (EV6 and EV8_1 of figure 163). A START clears TXE and BTF. STOP
 * and START wait for the shift register; a byte in DR is lost. A note reports a STOP or START that is requested while
 * TXE is 0, because the manual requires TXE or BTF. A byte written after this request is discarded without a note.
 *
 * NOT MODELLED, with a note: SMBUS, ENARP, ENPEC, PEC; OAR1, OAR2 (slave mode: the board has no other master). NOT
 * MODELLED: FLTR, stored; DUALF, SMBHOST, SMBDEFAULT, GENCALL, PEC of SR2; clock stretching, which the sensors never
 * do.
 */
#include <stdlib.h>

#include "fcu.h"

#include "generated/registers_i2c.h"

/* Flags that software clears by writing 0. */
#define SR1_ERRORS  \
  (SR1_BERR | SR1_ARLO | SR1_AF | SR1_OVR | SR1_PECERR | SR1_TIMEOUT | SR1_SMBALERT)

enum { FAST_MODE_HZ = 400000 }; /* highest clock of the sensors */
enum { NO_FUNCTION = 255 };

enum Completion {
  DONE_START,
  DONE_STOP,
  DONE_WAIT,
  DONE_ADDRESS,
  DONE_SEND,
  DONE_RECEIVE,
};

/* The current operation, or the event that ends a pause with SCL low. */
enum Phase {
  PHASE_IDLE,
  PHASE_BUSY,
  PHASE_ADDRESS,   /* waits for the address in DR */
  PHASE_ADDRESSED, /* waits until ADDR is cleared */
  PHASE_SEND,      /* waits for DR, STOP or START */
  PHASE_FULL,      /* waits for a read of DR */
  PHASE_ENDED,     /* no acknowledge: waits for STOP or START */
};

enum Noted {
  NOTED_DATA_LOST,
  NOTED_STOP_EARLY,
  NOTED_CCR,
  NOTED_TRISE,
  NOTED_SMBUS,
  NOTED_ENARP,
  NOTED_ENPEC,
  NOTED_PEC,
  NOTED_OAR1,
  NOTED_OAR2,
};

static I2c *i2c_of(Peripheral *peripheral) { return (I2c *)peripheral; }

static int64_t now_ps(const I2c *i2c) { return i2c->peripheral.chip->now_ps; }

static int number_of(const I2c *i2c) { return (int)(i2c - i2c->peripheral.chip->i2c); }

/* If the pins of an I2C are not switched to it, it reaches no device. */
static bool is_connected(I2c *i2c) {
  char missing[64];
  bool connected = pins_connected(i2c->peripheral.chip, i2c->pins, missing, sizeof missing);
  if (!connected) {
    peripheral_note(&i2c->peripheral, -1, NOTE_FORBIDDEN,
                    "pins-not-switched | no device can answer before the pins are switched: %s", missing);
  }
  return connected && i2c->calls.start;
}

static void set_lines(I2c *i2c) {
  static const uint8_t inputs[I2C_COUNT][2] = {{31, 32}, {33, 34}, {72, 73}}; /* RM0368 table 38 */
  const uint8_t *input = inputs[number_of(i2c)];
  uint32_t events = SR1_SB | SR1_ADDR | SR1_BTF | (i2c->cr2 & CR2_ITBUFEN ? SR1_TXE | SR1_RXNE : 0);
  peripheral_set_irq(&i2c->peripheral, input[0], i2c->cr2 & CR2_ITEVTEN && i2c->sr1 & events);
  peripheral_set_irq(&i2c->peripheral, input[1], i2c->cr2 & CR2_ITERREN && i2c->sr1 & SR1_ERRORS);
}

static void serve_dma(I2c *i2c) {
  Chip *chip = i2c->peripheral.chip;
  enum Request rx = (enum Request)(REQUEST_I2C1_RX + 2 * number_of(i2c)), tx = (enum Request)(rx + 1);
  for (int stage = 0; stage < 2; stage++) {
    if (i2c->sr1 & SR1_RXNE && dma_request(chip, rx)) {
      i2c->nack_next = i2c->cr2 & CR2_LAST && dma_remaining(chip, rx) == 1;
    }
    if (i2c->sr1 & SR1_TXE) {
      dma_request(chip, tx);
    }
  }
}

static void update(I2c *i2c) {
  if (i2c->in_dma || !i2c->wants_events) {
    return;
  }
  if (i2c->cr2 & CR2_DMAEN) {
    i2c->in_dma = 1;
    serve_dma(i2c);
    i2c->in_dma = 0;
  }
  set_lines(i2c);
}

static void i2c_dma_ready(Peripheral *peripheral) { update(i2c_of(peripheral)); }

static int64_t due_ps(const I2c *i2c) { return event_at(i2c->peripheral.chip, i2c->event); }

static void schedule_end(I2c *i2c, int64_t at_ps, enum Completion completion) {
  i2c->completion = (uint8_t)completion;
  (i2c->wants_events ? event_schedule : event_defer)(i2c->peripheral.chip, i2c->event, at_ps);
}

static void begin_operation(I2c *i2c, int64_t duration_ps, enum Completion completion) {
  i2c->phase = PHASE_BUSY;
  if (duration_ps < NEVER_PS) {
    schedule_end(i2c, now_ps(i2c) + duration_ps, completion);
  }
}

static void start(I2c *i2c) {
  i2c->start_ps = now_ps(i2c);
  i2c->sr2 |= SR2_BUSY;
  begin_operation(i2c, i2c->bit_ps, DONE_START);
}

static void start_when_free(I2c *i2c) {
  int64_t free_ps = i2c_wire_released_ps(i2c);
  if (free_ps) {
    i2c->phase = PHASE_BUSY;
    schedule_end(i2c, free_ps, DONE_WAIT);
  } else {
    start(i2c);
  }
}

/* Execute a requested STOP or START between two bytes; return false without a request. */
static bool stop_or_start(I2c *i2c) {
  if (!(i2c->cr1 & (CR1_START | CR1_STOP))) {
    return false;
  }
  if (i2c->cr1 & CR1_STOP) {
    begin_operation(i2c, i2c->bit_ps, DONE_STOP);
  } else {
    start(i2c);
  }
  return true;
}

static void continue_bus(I2c *i2c) {
  if (i2c->phase == PHASE_IDLE) {
    i2c->cr1 &= ~(uint32_t)CR1_STOP;
    if (i2c->cr1 & CR1_START) {
      start_when_free(i2c);
    }
  } else if (i2c->phase != PHASE_BUSY && i2c->phase != PHASE_ADDRESSED) {
    stop_or_start(i2c);
  }
}

/* Clear TXE, BTF and a byte that waits to be sent. Received bytes stay readable. */
static void end_of_sending(I2c *i2c) {
  if (i2c->sr2 & SR2_TRA) {
    i2c->sr1 &= ~(uint32_t)(SR1_TXE | SR1_BTF);
  }
  i2c->dr_full = 0;
}

static void started(I2c *i2c) {
  i2c->cr1 &= ~(uint32_t)CR1_START;
  end_of_sending(i2c);
  i2c->sr1 |= SR1_SB;
  i2c->sr2 = SR2_MSL | SR2_BUSY;
  i2c->phase = PHASE_ADDRESS;
  continue_bus(i2c); /* STOP "after the current Start condition is sent" (18.6.1) */
}

static void stopped(I2c *i2c) {
  i2c_wire_end(i2c, now_ps(i2c));
  i2c->cr1 &= ~(uint32_t)CR1_STOP;
  end_of_sending(i2c);
  i2c->sr1 &= ~(uint32_t)SR1_SB;
  i2c->sr2 = 0;
  i2c->phase = PHASE_IDLE;
  continue_bus(i2c);
}

static void end_with_error(I2c *i2c, uint32_t flag) {
  i2c->sr1 |= flag;
  i2c->phase = PHASE_ENDED;
  stop_or_start(i2c);
}

static void address_sent(I2c *i2c) {
  switch (is_connected(i2c) ? i2c_wire_address(i2c) : ANSWER_NACK) {
  case ANSWER_ACK:
    i2c->sr1 |= i2c->shift & 1 ? SR1_ADDR : SR1_ADDR | SR1_TXE;
    i2c->sr2 |= i2c->shift & 1 ? 0 : SR2_TRA;
    i2c->acknowledge = (i2c->cr1 & CR1_ACK) != 0;
    i2c->phase = PHASE_ADDRESSED;
    break;
  case ANSWER_ARBITRATION:
    i2c_wire_abort(i2c);
    i2c->sr1 |= SR1_ARLO;
    i2c->sr2 = 0;
    i2c->phase = PHASE_IDLE;
    break;
  case ANSWER_BUS_ERROR:
    end_with_error(i2c, SR1_BERR);
    break;
  default:
    end_with_error(i2c, SR1_AF);
  }
}

static void send(I2c *i2c) {
  i2c->shift = (uint8_t)i2c->dr;
  i2c->dr_full = 0;
  i2c->sr1 |= SR1_TXE;
  begin_operation(i2c, i2c->byte_ps, DONE_SEND);
}

static void sent(I2c *i2c) {
  if (!i2c_wire_write(i2c)) {
    end_with_error(i2c, SR1_AF);
  } else if (stop_or_start(i2c)) {
    return;
  } else if (i2c->dr_full) {
    send(i2c);
  } else {
    i2c->sr1 |= SR1_BTF;
    i2c->phase = PHASE_SEND;
  }
}

/* Return whether ACK, POS and, if DMA is used, LAST make the I2C acknowledge the byte. */
static bool acknowledges(I2c *i2c) {
  bool now = i2c->cr1 & CR1_ACK;
  bool acknowledged = i2c->cr1 & CR1_POS ? i2c->acknowledge : now;
  i2c->acknowledge = now;
  if (i2c->nack_next) {
    i2c->nack_next = 0;
    return false;
  }
  return acknowledged;
}

static void received(I2c *i2c) {
  uint8_t value = i2c_wire_read(i2c);
  bool acknowledged = acknowledges(i2c);
  if (i2c->sr1 & SR1_RXNE) {
    i2c->shift = value;
    i2c->shift_full = 1;
    i2c->sr1 |= SR1_BTF;
  } else {
    i2c->dr = value;
    i2c->sr1 |= SR1_RXNE;
  }
  if (stop_or_start(i2c)) {
    return;
  }
  if (!acknowledged) {
    i2c->phase = PHASE_ENDED;
  } else if (i2c->shift_full) {
    i2c->phase = PHASE_FULL;
  } else {
    begin_operation(i2c, i2c->byte_ps, DONE_RECEIVE);
  }
}

static void released(I2c *i2c) {
  i2c->phase = PHASE_IDLE;
  continue_bus(i2c);
}

static void i2c_fire(Peripheral *peripheral) {
  static void (*const ends[])(I2c *) = {
      [DONE_START] = started,        [DONE_STOP] = stopped, [DONE_WAIT] = released,
      [DONE_ADDRESS] = address_sent, [DONE_SEND] = sent,    [DONE_RECEIVE] = received,
  };
  I2c *i2c = i2c_of(peripheral);
  ends[i2c->completion](i2c);
  if (i2c->wants_events) {
    update(i2c);
  }
}

/* Abort the message and reset the bus state; firmware may cause this at any point of a message. */
static void clear(I2c *i2c) {
  event_cancel(i2c->peripheral.chip, i2c->event);
  i2c_wire_abort(i2c);
  i2c->cr1 = i2c->sr1 = i2c->sr2 = i2c->dr = i2c->last_sr1 = 0;
  i2c->phase = PHASE_IDLE;
  i2c->shift = i2c->dr_full = i2c->shift_full = i2c->acknowledge = i2c->nack_next = 0;
}

/* -- settings (18.6.2, 18.6.8, 18.6.9) ---------------------------------------------------------------- */

/* Return the SCL period in clocks of PCLK1; 0 if CCR is 0. */
static int64_t clocks_per_bit(uint32_t ccr) {
  int64_t per_period = ccr & CCR_FS ? (ccr & CCR_DUTY ? 25 : 3) : 2; /* high + low: 9 + 16, 1 + 2, 1 + 1 */
  return per_period * (ccr & CCR_CCR);
}

static int64_t rounded(__int128 dividend, __int128 divisor) { /* Round half to even. */
  __int128 quotient = dividend / divisor, twice = dividend % divisor * 2;
  return (int64_t)(quotient + (twice > divisor || (twice == divisor && quotient & 1)));
}

static void set_rate(I2c *i2c) {
  i2c->settings_checked = 0;
  int64_t dividend = clocks_per_bit(i2c->ccr) * PS_PER_S, divisor = i2c->peripheral.chip->clocks.pclk1_hz;
  if (dividend == 0 || divisor <= 0) {
    i2c->bit_ps = i2c->byte_ps = NEVER_PS;
    return;
  }
  if (dividend < (__int128)i2c->shortest_ps * divisor) {
    dividend = i2c->shortest_ps;
    divisor = 1;
  }
  i2c->bit_ps = dividend / divisor;
  i2c->byte_ps = 9 * dividend / divisor;
  if (i2c->cr1 & CR1_PE && i2c->calls.set_speed) {
    int64_t speed_hz = rounded((__int128)PS_PER_S * divisor, dividend);
    if (speed_hz != i2c->speed_hz) {
      i2c->speed_hz = speed_hz;
      i2c->calls.set_speed(now_ps(i2c), speed_hz);
    }
  }
}

/* Add notes about forbidden settings. SCL runs even with such settings. */
static void check_settings(I2c *i2c) {
  Peripheral *peripheral = &i2c->peripheral;
  int64_t pclk_hz = peripheral->chip->clocks.nominal_pclk1_hz, counts = clocks_per_bit(i2c->ccr);
  uint32_t freq = i2c->cr2 & CR2_FREQ, fast = i2c->ccr & CCR_FS, count = i2c->ccr & CCR_CCR;
  uint32_t slowest = fast ? 4 : 2, longest = freq * (fast ? 300 : 1000) / 1000 + 1; /* rise times in ns */
  const char *mode = fast ? "fast" : "standard";
  i2c->settings_checked = 1;
  if (llabs(freq * INT64_C(1000000) - pclk_hz) >= 1000000) {
    peripheral_note(
        peripheral, -1, NOTE_FORBIDDEN,
        "freq-wrong freq_mhz=%u pclk1_mhz=%g | CR2.FREQ is %u, but PCLK1 is %g MHz: set-up and hold times are wrong",
        freq, (double)pclk_hz / 1e6, freq, (double)pclk_hz / 1e6);
  }
  if (freq < slowest) {
    peripheral_note(
        peripheral, -1, NOTE_FORBIDDEN,
        "pclk1-too-slow mode=%s freq_mhz=%u min_mhz=%u | %s mode needs PCLK1 of at least %u MHz, but CR2.FREQ is %u",
        mode, freq, slowest, mode, slowest, freq);
  }
  if (count < (fast && i2c->ccr & CCR_DUTY ? 1 : 4)) {
    peripheral_note(peripheral, -1, NOTE_FORBIDDEN,
                    "ccr-too-small ccr=%u | CCR must be at least 4, or 1 with DUTY, not %u", count, count);
  }
  if (i2c->trise != longest) {
    peripheral_note(peripheral, -1, NOTE_FORBIDDEN,
                    "trise-wrong trise=%u fits=%u | TRISE is %u; %s mode at %u MHz needs %u", i2c->trise, longest,
                    i2c->trise, mode, freq, longest);
  }
  if (counts && pclk_hz * 100 > counts * FAST_MODE_HZ * 101) {
    peripheral_note(peripheral, -1, NOTE_FORBIDDEN,
                    "scl-too-fast scl_khz=%.0f max_khz=400 | SCL runs at %.0f kHz; the sensors' limit is 400 kHz",
                    (double)pclk_hz / (double)counts / 1000, (double)pclk_hz / (double)counts / 1000);
  }
}

static void note_not_modelled(I2c *i2c, uint32_t bits, enum Noted id, const char *text) {
  if (bits) {
    peripheral_note(&i2c->peripheral, (int)id, NOTE_NOT_MODELLED, "not-modelled | %s", text);
  }
}

static void i2c_reset(Peripheral *peripheral) {
  I2c *i2c = i2c_of(peripheral);
  clear(i2c);
  i2c->cr2 = i2c->oar1 = i2c->oar2 = i2c->ccr = i2c->fltr = 0;
  i2c->trise = 2;
  i2c->wants_events = 0;
  set_rate(i2c);
  set_lines(i2c);
}

static void i2c_clocks_changed(Peripheral *peripheral) { set_rate(i2c_of(peripheral)); }

static void clear_addr(I2c *i2c) {
  i2c->sr1 &= ~(uint32_t)SR1_ADDR;
  if (!(i2c->sr2 & SR2_TRA)) {
    begin_operation(i2c, i2c->byte_ps, DONE_RECEIVE);
    return;
  }
  i2c->phase = PHASE_SEND;
  if (i2c->dr_full) {
    send(i2c);
  } else {
    stop_or_start(i2c);
  }
}

/* Read DR. A byte in the shift register then moves to DR, and SCL is released. */
static uint32_t read_data(I2c *i2c) {
  uint32_t value = i2c->dr;
  if (i2c->shift_full) {
    i2c->dr = i2c->shift;
    i2c->shift_full = 0;
    i2c->sr1 &= ~(uint32_t)SR1_BTF;
    if (i2c->phase == PHASE_FULL) {
      begin_operation(i2c, i2c->byte_ps, DONE_RECEIVE);
    }
  } else {
    i2c->sr1 &= ~(uint32_t)SR1_RXNE;
  }
  update(i2c);
  return value;
}

static uint32_t i2c_peek(const Peripheral *peripheral, uint32_t offset) {
  const I2c *i2c = (const I2c *)peripheral;
  switch (offset) {
  case CR1: return i2c->cr1;
  case CR2: return i2c->cr2;
  case OAR1: return i2c->oar1;
  case OAR2: return i2c->oar2;
  case DR: return i2c->dr;
  case SR1: return i2c->sr1;
  case SR2: return i2c_wire_released_ps(i2c) ? i2c->sr2 | SR2_BUSY : i2c->sr2;
  case CCR: return i2c->ccr;
  case TRISE: return i2c->trise;
  case FLTR: return i2c->fltr;
  default: return 0;
  }
}

/* A read of SR1 and then SR2 clears ADDR (18.6.6). */
static uint32_t read_sr2(I2c *i2c, int64_t *until_ps) {
  int64_t free_ps = i2c_wire_released_ps(i2c);
  uint32_t status = free_ps ? i2c->sr2 | SR2_BUSY : i2c->sr2;
  *until_ps = free_ps && free_ps < *until_ps ? free_ps : *until_ps;
  if (i2c->sr1 & SR1_ADDR) {
    *until_ps = NOT_CACHEABLE_PS;
    if (i2c->last_sr1 & SR1_ADDR) {
      i2c->last_sr1 = 0;
      clear_addr(i2c);
      update(i2c);
    }
  }
  return status;
}

static uint32_t i2c_read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  I2c *i2c = i2c_of(peripheral);
  *until_ps = due_ps(i2c);
  switch (offset) {
  case SR1:
    i2c->last_sr1 = i2c->sr1;
    return i2c->sr1;
  case SR2:
    return read_sr2(i2c, until_ps);
  case DR:
    *until_ps = NOT_CACHEABLE_PS;
    return read_data(i2c);
  default:
    return i2c_peek(peripheral, offset);
  }
}

static void write_data(I2c *i2c, uint8_t value) {
  if (i2c->phase == PHASE_ADDRESS) {
    i2c->sr1 &= ~(uint32_t)SR1_SB;
    i2c->shift = value;
    begin_operation(i2c, i2c->byte_ps, DONE_ADDRESS);
  } else if (i2c->sr2 & SR2_TRA) {
    if (i2c->dr_full && !(i2c->cr1 & (CR1_START | CR1_STOP))) {
      peripheral_note(&i2c->peripheral, NOTED_DATA_LOST, NOTE_FORBIDDEN,
                      "data-lost | DR written while TXE was 0: the byte that waited there is lost");
    }
    i2c->sr1 &= ~(uint32_t)SR1_BTF;
    i2c->dr = value;
    if (i2c->phase == PHASE_SEND) {
      send(i2c);
    } else {
      i2c->dr_full = 1;
      i2c->sr1 &= ~(uint32_t)SR1_TXE;
    }
  }
}

static void write_cr1(I2c *i2c, uint32_t cr1) {
  uint32_t before = i2c->cr1;
  note_not_modelled(i2c, cr1 & CR1_SMBUS, NOTED_SMBUS, "SMBUS");
  note_not_modelled(i2c, cr1 & CR1_ENARP, NOTED_ENARP, "ENARP");
  note_not_modelled(i2c, cr1 & CR1_ENPEC, NOTED_ENPEC, "ENPEC (packet error check)");
  note_not_modelled(i2c, cr1 & CR1_PEC, NOTED_PEC, "PEC");
  if (cr1 & CR1_SWRST) {
    i2c_reset(&i2c->peripheral);
    i2c->cr1 = CR1_SWRST;
  } else if (!(cr1 & CR1_PE)) {
    if (before & CR1_PE) {
      clear(i2c);
    }
    i2c->cr1 = cr1 & ~(uint32_t)(CR1_START | CR1_STOP);
  } else {
    if (!(before & CR1_PE)) {
      i2c->cr1 = CR1_PE;
      set_rate(i2c);
    }
    if (cr1 & CR1_START && !i2c->settings_checked) {
      check_settings(i2c);
    }
    if (cr1 & ~before & (CR1_START | CR1_STOP) && i2c->dr_full && i2c->phase != PHASE_ENDED) {
      peripheral_note(&i2c->peripheral, NOTED_STOP_EARLY, NOTE_FORBIDDEN,
                      "stop-early | STOP or START while a byte waits in DR (TXE = 0): that byte is not sent");
    }
    i2c->cr1 = cr1; /* START and STOP wait for a byte in progress */
    continue_bus(i2c);
  }
}

static void write_cr2(I2c *i2c) {
  i2c->wants_events = (i2c->cr2 & (CR2_ITERREN | CR2_ITEVTEN | CR2_DMAEN)) != 0;
  if (due_ps(i2c) < NEVER_PS) {
    schedule_end(i2c, due_ps(i2c), (enum Completion)i2c->completion);
  }
  set_lines(i2c);
}

static void note_if_enabled(I2c *i2c, enum Noted id, const char *name) {
  if (i2c->cr1 & CR1_PE) {
    peripheral_note(&i2c->peripheral, (int)id, NOTE_FORBIDDEN,
                    "written-while-enabled register=%s | %s written while PE in CR1 is 1", name, name);
  }
}

static void configure(I2c *i2c, uint32_t offset, uint32_t value, uint32_t mask) {
  switch (offset) {
  case CR2:
    write_bits(&i2c->cr2, value, mask, CR2_STORED);
    write_cr2(i2c);
    break;
  case OAR1:
    write_bits(&i2c->oar1, value, mask, OAR1_STORED);
    note_not_modelled(i2c, i2c->oar1 & OAR1_ADD, NOTED_OAR1,
                 "slave mode: an own address is set, but the board has no other master");
    break;
  case OAR2:
    write_bits(&i2c->oar2, value, mask, OAR2_STORED);
    note_not_modelled(i2c, i2c->oar2 & 1, NOTED_OAR2,
                 "slave mode: a second own address is set, but the board has no other master");
    break;
  case CCR:
    write_bits(&i2c->ccr, value, mask, CCR_STORED);
    note_if_enabled(i2c, NOTED_CCR, "CCR");
    set_rate(i2c);
    break;
  case TRISE:
    write_bits(&i2c->trise, value, mask, TRISE_STORED);
    note_if_enabled(i2c, NOTED_TRISE, "TRISE");
    break;
  case FLTR:
    write_bits(&i2c->fltr, value, mask, FLTR_STORED);
    break;
  }
  i2c->settings_checked = 0;
}

static void i2c_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  I2c *i2c = i2c_of(peripheral);
  uint32_t cr1 = i2c->cr1;
  switch (offset) {
  case DR:
    write_data(i2c, (uint8_t)value);
    break;
  case SR1:
    i2c->sr1 &= value | ~(mask & SR1_ERRORS);
    break;
  case CR1:
    write_bits(&cr1, value, mask, CR1_STORED);
    write_cr1(i2c, cr1);
    break;
  default:
    configure(i2c, offset, value, mask);
  }
  update(i2c);
}

static const PeripheralType i2c_type = {
    .read = i2c_read,
    .peek = i2c_peek,
    .write = i2c_write,
    .reset = i2c_reset,
    .clocks_changed = i2c_clocks_changed,
    .dma_ready = i2c_dma_ready,
};

static void create(Chip *chip, I2c *i2c, uint32_t base) {
  peripheral_create(chip, &i2c->peripheral, &i2c_type, base, I2C1_SIZE, I2C_OFFSETS);
  i2c->event = event_create(&i2c->peripheral, i2c_fire);
  i2c->pins[0].function = NO_FUNCTION;
  for (int address = 0; address < 128; address++) {
    i2c->wire.target_index[address] = -1;
  }
  enum Request rx = (enum Request)(REQUEST_I2C1_RX + 2 * number_of(i2c));
  dma_connect(&i2c->peripheral, rx);
  dma_connect(&i2c->peripheral, (enum Request)(rx + 1));
  i2c_reset(&i2c->peripheral);
}

void i2c_create(Chip *chip) {
  static const uint32_t bases[I2C_COUNT] = {I2C1_BASE, I2C2_BASE, I2C3_BASE};
  for (int n = 0; n < I2C_COUNT; n++) {
    create(chip, &chip->i2c[n], bases[n]);
  }
}

void fcu_connect_i2c(Chip *chip, int32_t number, const I2cCalls *calls, int64_t speed_hz, int64_t shortest_ps) {
  I2c *i2c = &chip->i2c[number];
  i2c->calls = *calls;
  i2c->speed_hz = speed_hz;
  i2c->shortest_ps = shortest_ps;
  set_rate(i2c);
}

void fcu_i2c_pin(Chip *chip, int32_t number, int32_t which, int32_t port, int32_t pin, int32_t function) {
  PinFunction *pins = chip->i2c[number].pins;
  pins[which] = (PinFunction){"ABCDEH"[port], (uint8_t)pin, (uint8_t)function};
  pins[which + 1].function = NO_FUNCTION;
}
