/* EXTI (RM0368 section 10.2; interrupts: table 38), and SYSCFG, which selects EXTI's pins (section 7).
 *
 * Lines 0 to 15: pins; 16 PVD, 17 RTC alarm, 18 USB wake-up, 21 RTC tamper and time stamp, 22 RTC wake-up. An edge
 * sets the pending bit even if IMR is 0 (figure 29), but not if only EMR is 1 (10.2.3). SWIER sets the pending bit only
 * if IMR is 1, as the manual's text says.
 *
 * If a line is in EMR, an edge or SWIER is an event, which ends WFE and triggers the ADC (10.2.3, 11.6).
 *
 * NOT MODELLED
 * - SYSCFG_MEMRMP: stored, and a note; address 0 is the flash.
 * - SYSCFG_PMC: stored.
 */
#include "peripherals/exti.h"

#include <string.h>

#include "chip.h"
#include "fcu.h"
#include "generated/registers_exti.h"
#include "generated/registers_syscfg.h"

#define LINES IMR_STORED

/* RM0368 table 38. */
static const struct {
  int number;
  uint32_t lines;
} GROUPS[] = {
  {6, 1u << 0}, {7, 1u << 1}, {8, 1u << 2}, {9, 1u << 3}, {10, 1u << 4}, {23, 0x03E0}, {40, 0xFC00},
  {1, 1u << 16}, {41, 1u << 17}, {42, 1u << 18}, {2, 1u << 21}, {3, 1u << 22},
};

static void update_irqs(Exti *exti) {
  uint32_t active = exti->pr & exti->imr;
  for (size_t n = 0; n < sizeof GROUPS / sizeof *GROUPS; n++) {
    peripheral_set_irq(&exti->peripheral, GROUPS[n].number, active & GROUPS[n].lines);
  }
}

/* The event is a pulse; the flag is for exti_wakes() only. */
static void send_events(Exti *exti, uint32_t lines) {
  Chip *chip = exti->peripheral.chip;
  lines &= exti->emr;
  if (!lines) {
    return;
  }
  exti->event = 1;
  core_send_event(&chip->core);
  for (int line = 0; lines >> line; line++) {
    if (lines >> line & 1) {
      adc_exti_event(chip, line);
    }
  }
}

bool exti_wakes(Exti *exti) {
  bool event = exti->event;
  exti->event = 0;
  return event || exti->pr & exti->imr;
}

static void set_line(Exti *exti, int line, bool level) {
  uint32_t bit = 1u << line;
  if (!(exti->levels & bit) == !level) {
    return;
  }
  exti->levels ^= bit;
  if ((level ? exti->rtsr : exti->ftsr) & bit) {
    exti->pr |= exti->emr & ~exti->imr & bit ? 0 : bit;
    send_events(exti, bit);
    update_irqs(exti);
  }
}

void exti_pin_changed(Exti *exti, int port, int pin, bool level) {
  if (exti->port[pin] == port) {
    set_line(exti, pin, level);
  }
}

static uint32_t exti_peek(const Peripheral *peripheral, uint32_t offset) {
  const Exti *exti = (const Exti *)peripheral;
  switch (offset) {
    case IMR: return exti->imr;
    case EMR: return exti->emr;
    case RTSR: return exti->rtsr;
    case FTSR: return exti->ftsr;
    case SWIER: return exti->swier;
    case PR: return exti->pr;
    default: return 0;
  }
}

/* Writing 1 to PR clears PR and SWIER (10.3.5, 10.3.6). */
static void exti_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Exti *exti = (Exti *)peripheral;
  uint32_t rising;
  switch (offset) {
    case IMR: write_bits(&exti->imr, value, mask, LINES); break;
    case EMR: write_bits(&exti->emr, value, mask, LINES); break;
    case RTSR: write_bits(&exti->rtsr, value, mask, LINES); break;
    case FTSR: write_bits(&exti->ftsr, value, mask, LINES); break;
    case SWIER:
      rising = value & ~exti->swier & LINES;
      exti->swier |= rising;
      exti->pr |= rising & exti->imr;
      send_events(exti, rising);
      break;
    case PR:
      exti->pr &= ~value;
      exti->swier &= ~value;
      break;
    default: break;
  }
  update_irqs(exti);
}

static void exti_reset(Peripheral *peripheral) {
  Exti *exti = (Exti *)peripheral;
  exti->imr = exti->emr = exti->rtsr = exti->ftsr = exti->swier = exti->pr = 0;
  exti->event = 0;
  update_irqs(exti);
}

static const PeripheralType EXTI_TYPE = {
  .read = peripheral_read_as_peek, .peek = exti_peek, .write = exti_write, .reset = exti_reset
};

/* Return the port that EXTICR selects (7.2.3 to 7.2.6), or -1 if no port has this code. */
static int selected_port(const Syscfg *syscfg, int line) {
  static const int8_t PORT_OF[16] = {0, 1, 2, 3, 4, -1, -1, 5, -1, -1, -1, -1, -1, -1, -1, -1};
  return PORT_OF[syscfg->registers[(EXTICR1 >> 2) + line / 4] >> line % 4 * 4 & 15];
}

/* A newly selected pin may cause an edge. */
static void select_pins(Chip *chip) {
  chip->work += WORK_PIN * (PIN_LINES / 4); /* at most four lines change */
  for (int line = 0; line < PIN_LINES; line++) {
    chip->exti.port[line] = selected_port(&chip->syscfg, line);
  }
  for (int line = 0; line < PIN_LINES; line++) {
    int port = chip->exti.port[line];
    set_line(&chip->exti, line, port >= 0 && chip->gpio.ports[port].input >> line & 1);
  }
}

static uint32_t syscfg_peek(const Peripheral *peripheral, uint32_t offset) {
  return ((const Syscfg *)peripheral)->registers[offset >> 2];
}

static uint32_t writable(uint32_t offset) {
  switch (offset) {
    case MEMRMP: return 0x3;
    case PMC: return 0x10000;
    case CMPCR: return CMPCR_CMP_PD;
    default: return 0xFFFF;
  }
}

static void syscfg_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  uint32_t *word = &((Syscfg *)peripheral)->registers[offset >> 2];
  write_bits(word, value, mask, writable(offset));
  if (offset == MEMRMP && *word) {
    peripheral_note(peripheral, 0, NOTE_NOT_MODELLED, "remap | MEMRMP: address 0 stays the flash");
  } else if (offset == CMPCR) {
    *word = *word & CMPCR_CMP_PD ? CMPCR_CMP_PD | CMPCR_READY : 0; /* ready immediately (7.2.7) */
  } else if (EXTICR1 <= offset && offset <= EXTICR4) {
    select_pins(peripheral->chip);
  }
}

static void syscfg_reset(Peripheral *peripheral) {
  memset(((Syscfg *)peripheral)->registers, 0, sizeof((Syscfg *)peripheral)->registers);
  select_pins(peripheral->chip);
}

static const PeripheralType SYSCFG_TYPE = {
  .read = peripheral_read_as_peek, .peek = syscfg_peek, .write = syscfg_write, .reset = syscfg_reset
};

void syscfg_create(Chip *chip) {
  peripheral_create(chip, &chip->syscfg.peripheral, &SYSCFG_TYPE, SYSCFG_BASE, SYSCFG_SIZE, SYSCFG_OFFSETS);
}

void exti_create(Chip *chip) {
  peripheral_create(chip, &chip->exti.peripheral, &EXTI_TYPE, EXTI_BASE, EXTI_SIZE, EXTI_OFFSETS);
  select_pins(chip);
}

void fcu_set_exti_line(Chip *chip, int32_t line, int32_t level) { set_line(&chip->exti, line, level != 0); }
