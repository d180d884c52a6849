/* USART1, USART2 and USART6 in asynchronous mode (RM0368 section 19; interrupts: table 38).
 *
 * TXE and TC are computed when SR is read; an event exists only while an interrupt or DMA waits. Python
 * receives sent bytes in groups. If a byte is written before TE is set, it waits in DR.
 *
 * TC is cleared by a read of SR and then a write of DR, or by writing 0 to TC. ORE and IDLE are cleared by a
 * read of SR that shows them and then a read of DR (19.3, 19.6.1).
 *
 * NOT MODELLED, with a note: synchronous, smartcard, IrDA, LIN, half-duplex, hardware flow control, mute,
 * break. NOT MODELLED, silent: parity and the ninth bit take time, but have no contents; the idle frame
 * after TE. If TE is cleared during a frame, the frame is sent completely (undefined in RM0368).
 */
#include "fcu.h"

#include <math.h>
#include <string.h>

#include "generated/registers_usart.h"

static const uint32_t STORED[] = {[BRR >> 2] = BRR_STORED, [CR1 >> 2] = CR1_STORED, [CR2 >> 2] = CR2_STORED,
                                  [CR3 >> 2] = CR3_STORED, [GTPR >> 2] = GTPR_STORED};
#define REGISTER(usart, offset) ((usart)->registers[(offset) >> 2])

#define SENDING (CR1_UE | CR1_TE)
#define RECEIVING (CR1_UE | CR1_RE)
#define BAUD_TOLERANCE 0.03 /* of a receiver (19.3.5) */

static const struct {
  uint32_t base;
  uint8_t apb, interrupt; /* apb: number of the bus that clocks the USART (RM0368 figure 12) */
  enum Request tx, rx;
} VARIANTS[USARTS] = {
  {USART1_BASE, 2, 37, REQUEST_USART1_TX, REQUEST_USART1_RX},
  {USART2_BASE, 1, 38, REQUEST_USART2_TX, REQUEST_USART2_RX},
  {USART6_BASE, 2, 71, REQUEST_USART6_TX, REQUEST_USART6_RX},
};

static const struct {
  uint32_t offset, bit;
  const char *name;
} UNMODELLED_BITS[] = {
  {CR1, CR1_SBK, "SBK (break)"},
  {CR1, CR1_RWU, "RWU (mute mode)"},
  {CR2, CR2_CLKEN, "CLKEN (synchronous mode)"},
  {CR2, CR2_LINEN, "LINEN (LIN mode)"},
  {CR3, CR3_IREN, "IREN (IrDA mode)"},
  {CR3, CR3_HDSEL, "HDSEL (half duplex)"},
  {CR3, CR3_SCEN, "SCEN (smartcard mode)"},
  {CR3, CR3_RTSE, "RTSE (flow control)"},
  {CR3, CR3_CTSE, "CTSE (flow control)"},
};

static void update(Usart *usart);

static int64_t now_of(const Usart *usart) { return usart->peripheral.chip->now_ps; }

static bool is_sending(const Usart *usart) { return (REGISTER(usart, CR1) & SENDING) == SENDING; }

/* Return NEVER_PS without a bit clock. */
static int64_t end_of(const UsartRun *run, int64_t frames) {
  __int128 at_ps = run->start_ps + (__int128)frames * run->frame.num / run->frame.den;
  return at_ps < NEVER_PS ? (int64_t)at_ps : NEVER_PS;
}

static void flush(Usart *usart, bool detailed) {
  const UsartCalls *calls = &usart->peripheral.chip->usarts.calls;
  const UsartRun *run = &usart->run;
  int32_t length = usart->buffer_length;
  usart->buffer_length = 0;
  if (length && calls->sent) {
    calls->sent(now_of(usart), usart->peripheral.index, run->start_ps, run->frame.num, run->frame.den, run->connected,
                run->count - length, usart->buffer, length, detailed);
  }
}

/* A gap, another frame duration, or a change of `connected` begins a new run of frames. */
static void open_run(Usart *usart, bool connected) {
  UsartRun *run = &usart->run;
  int64_t now_ps = now_of(usart);
  bool same = run->frame.num == usart->frame.num && run->frame.den == usart->frame.den;
  if (now_ps > usart->idle_ps || !same || run->connected != connected) {
    flush(usart, false);
    run->start_ps = now_ps > usart->idle_ps ? now_ps : usart->idle_ps;
    run->count = 0;
    run->frame = usart->frame;
    run->connected = connected;
  }
}

/* DR must be empty. */
static void transmit(Usart *usart, uint8_t value, bool connected) {
  bool detailed = usart->peripheral.chip->detailed;
  UsartRun *run = &usart->run;
  open_run(usart, connected);
  if (detailed || usart->buffer_length == USART_BUFFER) {
    flush(usart, false);
  }
  usart->buffer[usart->buffer_length++] = value;
  run->count++;
  usart->txe_ps = end_of(run, run->count - 1);
  usart->idle_ps = end_of(run, run->count);
  if (detailed) {
    flush(usart, true);
  }
}

static void replace(Usart *usart, uint8_t value) {
  const UsartCalls *calls = &usart->peripheral.chip->usarts.calls;
  if (usart->buffer_length) {
    usart->buffer[usart->buffer_length - 1] = value;
  } else if (calls->replaced) {
    calls->replaced(now_of(usart), usart->peripheral.index, value);
  }
}

static uint32_t status_of(const Usart *usart) {
  int64_t now_ps = now_of(usart);
  uint32_t status = now_ps >= usart->tc_ps ? SR_TC : 0;
  status |= now_ps >= usart->txe_ps && usart->pending_byte < 0 ? SR_TXE : 0;
  status |= usart->rx_byte >= 0 ? SR_RXNE : 0;
  status |= usart->overrun ? SR_ORE : 0;
  return status | (usart->idle ? SR_IDLE : 0);
}

static int64_t next_flag_ps(const Usart *usart) {
  int64_t now_ps = now_of(usart), at_ps = NEVER_PS;
  if (usart->txe_ps > now_ps) {
    at_ps = usart->txe_ps;
  }
  return usart->tc_ps > now_ps && usart->tc_ps < at_ps ? usart->tc_ps : at_ps;
}

/* Section 19.3.4. */
static int64_t ticks_per_bit(const Usart *usart) {
  uint32_t brr = REGISTER(usart, BRR);
  return REGISTER(usart, CR1) & CR1_OVER8 ? (brr >> 4) * 8 + (brr & 7) : brr;
}

static int64_t kernel_hz(const Usart *usart) {
  const Clocks *clocks = &usart->peripheral.chip->clocks;
  return VARIANTS[usart->number].apb == 1 ? clocks->pclk1_hz : clocks->pclk2_hz;
}

static int half_bits(const Usart *usart) {
  static const uint8_t STOP_HALF_BITS[] = {2, 1, 4, 3};
  return 2 * (REGISTER(usart, CR1) & CR1_M ? 10 : 9) + STOP_HALF_BITS[FIELD(REGISTER(usart, CR2), CR2_STOP)];
}

/* A terminal with other settings shows garbage. */
static void check_terminal_settings(Usart *usart, double baud, bool plain) {
  int expected = usart->terminal_baud;
  if (!expected) {
    return;
  }
  if (fabs(baud / expected - 1) > BAUD_TOLERANCE) {
    peripheral_note(&usart->peripheral, -1, NOTE_FORBIDDEN,
                    "baud-rate baud=%.0f expected=%d | %.0f baud; a terminal at %d baud would show garbage", baud,
                    expected, baud, expected);
  }
  if (!plain) {
    peripheral_note(&usart->peripheral, -1, NOTE_FORBIDDEN,
                    "frame-format | frames are not 8N1; a terminal set to 8N1 would show garbage");
  }
}

/* Check after a write to a register, and at the first byte after a change of the clocks: firmware may change the
 * clocks in several steps, for example after Stop. */
static void check_settings(Usart *usart) {
  int64_t ticks = ticks_per_bit(usart), hz = kernel_hz(usart);
  if (!usart->settings_checked && ticks && hz && is_sending(usart)) {
    usart->settings_checked = true;
    bool plain = half_bits(usart) == 20 && !(REGISTER(usart, CR1) & CR1_PCE);
    check_terminal_settings(usart, (double)hz / (double)ticks, plain);
  }
}

static void send(Usart *usart, uint8_t value) {
  char missing[40];
  int64_t now_ps = now_of(usart);
  bool stays_set = now_ps >= usart->tc_ps && !usart->sr_read;
  bool connected = pins_connected(usart->peripheral.chip, usart->pins, missing, sizeof missing);
  if (!connected) {
    peripheral_note(&usart->peripheral, -1, NOTE_FORBIDDEN,
                    "pins-not-switched | a byte is sent, but nothing leaves the chip: switch %s", missing);
  }
  check_settings(usart);
  if (now_ps >= usart->txe_ps) {
    transmit(usart, value, connected);
  } else {
    replace(usart, value);
    peripheral_note(&usart->peripheral, -1, NOTE_FORBIDDEN,
                    "data-lost | DR written while TXE was 0: the byte that waited there is lost");
  }
  if (!stays_set) {
    usart->tc_ps = usart->idle_ps;
  }
  usart->sr_read = false;
}

static void write_data(Usart *usart, uint8_t value) {
  if (is_sending(usart)) {
    send(usart, value);
    return;
  }
  usart->pending_byte = value;
  usart->tc_ps = NEVER_PS;
  peripheral_note(
      &usart->peripheral, -1, NOTE_FORBIDDEN,
      "written-while-disabled | DR written while UE or TE in CR1 is 0: the byte waits until both are set");
}

static void take_data(Usart *usart) {
  if (usart->rx_byte >= 0) {
    usart->received = (uint8_t)usart->rx_byte;
    usart->rx_byte = -1;
  }
}

static uint32_t read_data(Usart *usart) {
  take_data(usart);
  usart->overrun = usart->overrun && !(usart->last_sr & SR_ORE);
  usart->idle = usart->idle && !(usart->last_sr & SR_IDLE);
  usart->last_sr = 0;
  if (usart->wants_events) {
    update(usart);
  }
  return usart->received;
}

static void clear_flags(Usart *usart, uint32_t kept) {
  if (!(kept & SR_TC) && now_of(usart) >= usart->tc_ps) {
    usart->tc_ps = now_of(usart) < usart->idle_ps ? usart->idle_ps : NEVER_PS;
  }
  if (!(kept & SR_RXNE)) {
    usart->rx_byte = -1;
  }
}

/* BRR, OVER8, M and STOP (19.3.4). */
static void set_frame(Usart *usart) {
  int64_t ticks = ticks_per_bit(usart), hz = kernel_hz(usart);
  usart->settings_checked = false;
  if (ticks == 0 || hz == 0) {
    usart->frame = (UsartFrame){NEVER_PS, 1};
    return;
  }
  int64_t num = half_bits(usart) * ticks * PS_PER_S, den = 2 * hz, divisor = gcd(num, den);
  usart->frame = (UsartFrame){num / divisor, den / divisor};
}

static void settings_changed(Usart *usart, uint32_t offset) {
  for (size_t n = 0; n < sizeof UNMODELLED_BITS / sizeof *UNMODELLED_BITS; n++) {
    if (UNMODELLED_BITS[n].offset == offset && REGISTER(usart, offset) & UNMODELLED_BITS[n].bit) {
      peripheral_note(&usart->peripheral, -1, NOTE_NOT_MODELLED, "not-modelled | %s", UNMODELLED_BITS[n].name);
    }
  }
  usart->wants_events = REGISTER(usart, CR1) & (CR1_IDLEIE | CR1_RXNEIE | CR1_TCIE | CR1_TXEIE) ||
                   REGISTER(usart, CR3) & (CR3_EIE | CR3_DMAR | CR3_DMAT);
  set_frame(usart);
  check_settings(usart);
  if (usart->pending_byte >= 0 && is_sending(usart)) {
    uint8_t value = (uint8_t)usart->pending_byte;
    usart->pending_byte = -1;
    usart->tc_ps = NEVER_PS;
    send(usart, value);
  }
  update(usart);
}

static void serve_dma(Usart *usart) {
  Chip *chip = usart->peripheral.chip;
  uint32_t cr3 = REGISTER(usart, CR3);
  if (cr3 & CR3_DMAR && usart->rx_byte >= 0) {
    dma_request(chip, VARIANTS[usart->number].rx);
  }
  if (cr3 & CR3_DMAT && is_sending(usart)) {
    for (int stage = 0; stage < 2; stage++) {
      if (status_of(usart) & SR_TXE) {
        dma_request(chip, VARIANTS[usart->number].tx);
      }
    }
  }
}

/* A flag and its enable bit have the same bit number, except error flags (19.4). */
static bool is_interrupt_active(const Usart *usart) {
  uint32_t cr1 = REGISTER(usart, CR1), status = status_of(usart);
  bool errors = cr1 & CR1_RXNEIE || (REGISTER(usart, CR3) & (CR3_EIE | CR3_DMAR)) == (CR3_EIE | CR3_DMAR);
  return status & cr1 & (SR_TXE | SR_TC | SR_RXNE | SR_IDLE) || (status & SR_ORE && errors);
}

/* Schedule an event for the flag that an interrupt or DMA waits for. */
static void schedule_next(Usart *usart) {
  Chip *chip = usart->peripheral.chip;
  int64_t at_ps = NEVER_PS;
  if ((REGISTER(usart, CR1) & CR1_TXEIE || REGISTER(usart, CR3) & CR3_DMAT) && usart->txe_ps > chip->now_ps) {
    at_ps = usart->txe_ps;
  }
  if (REGISTER(usart, CR1) & CR1_TCIE && usart->tc_ps > chip->now_ps && usart->tc_ps < at_ps) {
    at_ps = usart->tc_ps;
  }
  if (at_ps >= NEVER_PS) {
    event_cancel(chip, usart->event);
  } else if (at_ps != event_at(chip, usart->event)) {
    event_schedule(chip, usart->event, at_ps);
  }
}

static void update(Usart *usart) {
  if (usart->in_dma) {
    return;
  }
  usart->in_dma = true;
  serve_dma(usart);
  usart->in_dma = false;
  peripheral_set_irq(&usart->peripheral, VARIANTS[usart->number].interrupt, is_interrupt_active(usart));
  schedule_next(usart);
}

static void on_event(Peripheral *peripheral) { update((Usart *)peripheral); }

static void usart_dma_ready(Peripheral *peripheral) { update((Usart *)peripheral); }

static uint32_t usart_peek(const Peripheral *peripheral, uint32_t offset) {
  const Usart *usart = (const Usart *)peripheral;
  switch (offset) {
  case SR: return status_of(usart);
  case DR: return usart->rx_byte >= 0 ? (uint32_t)usart->rx_byte : usart->received;
  default: return REGISTER(usart, offset);
  }
}

static uint32_t usart_read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  Usart *usart = (Usart *)peripheral;
  if (offset == DR) {
    *until_ps = NOT_CACHEABLE_PS;
    return read_data(usart);
  }
  if (offset == SR) { /* this read begins a clearing sequence; further reads have no effect */
    *until_ps = next_flag_ps(usart);
    usart->sr_read = true;
    usart->last_sr = status_of(usart);
    return usart->last_sr;
  }
  return REGISTER(usart, offset);
}

static bool usart_is_pure(const Peripheral *peripheral, uint32_t offset) {
  (void)peripheral;
  return offset != DR;
}

static void usart_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Usart *usart = (Usart *)peripheral;
  if (offset == DR) {
    write_data(usart, (uint8_t)value);
  } else if (offset == SR) {
    clear_flags(usart, value | ~mask);
  } else {
    write_bits(&REGISTER(usart, offset), value, mask, STORED[offset >> 2]);
    settings_changed(usart, offset);
  }
  if (usart->wants_events) {
    update(usart);
  }
}

static void usart_clocks_changed(Peripheral *peripheral) { set_frame((Usart *)peripheral); }

/* Frames that have begun are finished. */
static void usart_reset(Peripheral *peripheral) {
  Usart *usart = (Usart *)peripheral;
  memset(usart->registers, 0, sizeof usart->registers);
  usart->tc_ps = 0;
  usart->pending_byte = usart->rx_byte = -1;
  usart->sr_read = usart->overrun = usart->idle = usart->wants_events = usart->received = 0;
  usart->last_sr = 0;
  update(usart);
}

static const PeripheralType USART = {
  .read = usart_read,
  .peek = usart_peek,
  .write = usart_write,
  .reset = usart_reset,
  .clocks_changed = usart_clocks_changed,
  .dma_ready = usart_dma_ready,
  .is_pure = usart_is_pure,
};

void usarts_create(Chip *chip) {
  for (int n = 0; n < USARTS; n++) {
    Usart *usart = &chip->usarts.usarts[n];
    peripheral_create(chip, &usart->peripheral, &USART, VARIANTS[n].base, USART1_SIZE, USART_OFFSETS);
    usart->number = n;
    usart->event = event_create(&usart->peripheral, on_event);
    usart->pins[0].function = 255;
    usart->run.frame.den = 1;
    dma_connect(&usart->peripheral, VARIANTS[n].tx);
    dma_connect(&usart->peripheral, VARIANTS[n].rx);
    set_frame(usart);
    usart_reset(&usart->peripheral);
  }
}

static Usart *usart_of(Chip *chip, int32_t index) { return (Usart *)chip->peripherals[index]; }

void fcu_connect_usarts(Chip *chip, const UsartCalls *calls) { chip->usarts.calls = *calls; }

void fcu_usart_wire(Chip *chip, int32_t index, int32_t port, int32_t pin, int32_t function, int32_t baud) {
  Usart *usart = usart_of(chip, index);
  usart->pins[0] = (PinFunction){"ABCDEH"[port], (uint8_t)pin, (uint8_t)function};
  usart->pins[1].function = 255;
  usart->terminal_baud = baud;
}

void fcu_usart_flush(Chip *chip, int32_t index) { flush(usart_of(chip, index), false); }

int32_t fcu_usart_frame(const Chip *chip, int32_t index, int64_t *num, int64_t *den) {
  const Usart *usart = (const Usart *)chip->peripherals[index];
  *num = usart->frame.num;
  *den = usart->frame.den;
  return usart->frame.num < NEVER_PS;
}

int64_t fcu_usart_next_change(Chip *chip, int32_t index) { return next_flag_ps(usart_of(chip, index)); }

int32_t fcu_usart_receive(Chip *chip, int32_t index, int32_t value) {
  Usart *usart = usart_of(chip, index);
  bool lost = usart->rx_byte >= 0;
  if ((REGISTER(usart, CR1) & RECEIVING) != RECEIVING) {
    return 1;
  }
  if (lost) { /* overrun: DR keeps the previous byte (19.3.3) */
    usart->overrun = true;
  } else {
    usart->rx_byte = (int16_t)(value & 0xFF);
  }
  update(usart);
  return !lost;
}

void fcu_usart_line_idle(Chip *chip, int32_t index) {
  Usart *usart = usart_of(chip, index);
  if ((REGISTER(usart, CR1) & RECEIVING) == RECEIVING) {
    usart->idle = true;
    update(usart);
  }
}
