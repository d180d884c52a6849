/* SysTick (ARMv7-M ARM B3.3).
 *
 * Each step from 1 to 0 sets COUNTFLAG and, if TICKINT is set, pends the exception; the next clock reloads
 * the counter. The period is RVR + 1. Steps to 0 are events, exactly one period apart; values in between are
 * computed. A new RVR takes effect at a reload; an RVR of 0 stops the counter. In Stop HCLK is 0, and the counter
 * keeps its value.
 */
#include "peripherals/systick.h"

#include "chip.h"

typedef __int128 Wide;

static bool is_counting(const SysTick *tick) { return event_at(tick->chip, tick->event) < NEVER_PS; }

/* The 1 ps compensates for rounding down. */
static int64_t elapsed(const SysTick *tick) {
  return (int64_t)((Wide)(tick->chip->now_ps - tick->origin_ps + 1) * tick->hz / PS_PER_S);
}

static int64_t counter(const SysTick *tick) {
  if (!is_counting(tick)) {
    return tick->value;
  }
  int64_t left = tick->first - elapsed(tick);
  if (left == tick->period && tick->value == 0) {
    return 0; /* not reloaded yet */
  }
  int64_t rest = left % tick->period;
  return rest < 0 ? rest + tick->period : rest;
}

static void schedule(SysTick *tick) {
  Wide cycles = tick->first + (Wide)tick->wraps * tick->period;
  event_schedule(tick->chip, tick->event, tick->origin_ps + (int64_t)(cycles * PS_PER_S / tick->hz));
}

/* If value is 0, the counter is reloaded first. */
static void start(SysTick *tick, int64_t value) {
  int64_t hclk_hz = tick->chip->clocks.hclk_hz;
  event_cancel(tick->chip, tick->event);
  tick->value = value;
  tick->is_stopped = hclk_hz == 0;
  if (!(tick->control & SYST_CSR_ENABLE) || (value == 0 && tick->reload == 0)) {
    return;
  }
  if (tick->is_stopped) {
    return;
  }
  tick->origin_ps = tick->chip->now_ps;
  tick->hz = hclk_hz / (tick->control & SYST_CSR_CLKSOURCE ? 1 : 8);
  tick->hz = tick->hz > 0 ? tick->hz : 1;
  tick->wraps = 0;
  tick->period = (int64_t)tick->reload + 1;
  tick->first = value ? value : tick->period;
  schedule(tick);
}

static void underflow(Peripheral *space) {
  SysTick *tick = &space->chip->systick;
  tick->control |= SYST_CSR_COUNTFLAG;
  if (tick->control & SYST_CSR_TICKINT) {
    nvic_pend(&tick->chip->nvic, SYS_TICK);
  }
  if (tick->reload && (int64_t)tick->reload + 1 == tick->period) {
    tick->wraps++;
    schedule(tick);
  } else {
    start(tick, 0);
  }
}

void systick_retime(SysTick *tick) {
  if (is_counting(tick) || tick->is_stopped) {
    start(tick, counter(tick));
  }
}

uint32_t systick_peek(const SysTick *tick, uint32_t offset) {
  switch (offset) {
  case SYST_CSR: return tick->control;
  case SYST_RVR: return tick->reload;
  case SYST_CVR: return (uint32_t)counter(tick);
  default: return SYST_CALIB_RESET;
  }
}

uint32_t systick_read(SysTick *tick, uint32_t offset, int64_t *until_ps) {
  uint32_t value = systick_peek(tick, offset);
  if (offset == SYST_CVR || (offset == SYST_CSR && tick->control & SYST_CSR_COUNTFLAG)) {
    *until_ps = NOT_CACHEABLE_PS;
  }
  if (offset == SYST_CSR) {
    tick->control &= ~SYST_CSR_COUNTFLAG;
  }
  return value;
}

static void write_csr(SysTick *tick, uint32_t control) {
  bool changed = (tick->control ^ control) & (SYST_CSR_ENABLE | SYST_CSR_CLKSOURCE);
  int64_t value = changed ? counter(tick) : 0;
  tick->control = (tick->control & SYST_CSR_COUNTFLAG) | (control & SYST_CSR_STORED);
  if (changed) {
    start(tick, value);
  }
}

void systick_write(SysTick *tick, uint32_t offset, uint32_t value, uint32_t mask) {
  if (offset == SYST_CSR) {
    write_csr(tick, (tick->control & ~mask) | value);
  } else if (offset == SYST_RVR) {
    tick->reload = ((tick->reload & ~mask) | value) & SYST_RVR_RELOAD;
    if (tick->control & SYST_CSR_ENABLE && !is_counting(tick)) {
      start(tick, tick->value); /* stopped at 0 */
    }
  } else if (offset == SYST_CVR) {
    tick->control &= ~SYST_CSR_COUNTFLAG;
    start(tick, 0);
  }
}

void systick_reset(SysTick *tick) {
  Chip *chip = tick->chip;
  int32_t event = tick->event;
  event_cancel(chip, event);
  *tick = (SysTick){.chip = chip, .event = event};
}

void systick_create(Chip *chip) {
  chip->systick = (SysTick){.chip = chip, .event = event_create(&chip->scb.peripheral, underflow)};
}
