/* TIM1 to TIM5 and TIM9 to TIM11 (RM0368 sections 12 to 14, tables 1, 38; pins: STM32F401xB/C datasheet).
 *
 * State is computed when it is read. An event exists only while an enabled interrupt or DMA request waits for its
 * flag, or the ADC waits for an edge. Therefore PWM alone needs no events. Missed updates are counted when the flag is
 * cleared.
 *
 * Times are counted in ticks of the timer's clock since origin_ps, so that they do not drift. The origin is moved so
 * that the ticks fit into 64 bits. tim_catch_up() needs few steps: the first step ends at the next update, which
 * loads the preloaded registers; then one step skips all whole cycles.
 *
 * Inputs are in tim_inputs.c, outputs in tim_outputs.c.
 *
 * NOT MODELLED, with a note: slave modes, external clocks, encoders (SMCR), DMA on capture and compare, DMA bursts.
 * NOT MODELLED, silent: synchronisation after CEN. A compare flag is raised when the counter arrives at CCR, not when a
 * write makes CNT and CCR equal. A timer without clock (RCC) continues to count.
 */
#include "fcu.h"

#include <string.h>

#include "peripherals/tim_counter.h"

_Static_assert(sizeof TIM_RESETS[0] == sizeof((Tim *)0)->registers, "the registers of a timer");

/* Flags of SR, enable bits of DIER and events of EGR. */
#define COM_TRIGGER (SR_COMIF | SR_TIF)
#define ALL_FLAGS 0xFFu
#define CC_DMA (DIER_CC1DE | DIER_CC2DE | DIER_CC3DE | DIER_CC4DE)
#define ECE_SMS (SMCR_ECE | SMCR_SMS)
/* A handler is late if the flag is still set after this time. Exception entry and HAL's check of flags
 * take about a hundred instructions. */
#define LATE_AFTER_PS INT64_C(10000000)

enum { NOTE_SMCR, NOTE_DIER, NOTE_DCR, NOTE_DMAR };

static const TimVariant VARIANTS[TIMERS] = {
  {TIM1_BASE, 2, 16, 4, 1, true, REQUEST_TIM1_UP,
   {{SR_UIF, 25}, {CC_FLAGS, 27}, {COM_TRIGGER, 26}, {SR_BIF, 24}}, {"A8 E9", "A9 E11", "A10 E13", "A11 E14"}},
  {TIM2_BASE, 1, 32, 4, 1, false, REQUEST_TIM2_UP,
   {{ALL_FLAGS, 28}}, {"A0 A5 A15", "A1 B3", "A2 B10", "A3 B11"}},
  {TIM3_BASE, 1, 16, 4, 2, false, REQUEST_TIM3_UP,
   {{ALL_FLAGS, 29}}, {"A6 B4 C6", "A7 B5 C7", "B0 C8", "B1 C9"}},
  {TIM4_BASE, 1, 16, 4, 2, false, REQUEST_TIM4_UP,
   {{ALL_FLAGS, 30}}, {"B6 D12", "B7 D13", "B8 D14", "B9 D15"}},
  {TIM5_BASE, 1, 32, 4, 2, false, REQUEST_TIM5_UP, {{ALL_FLAGS, 50}}, {"A0", "A1", "A2", "A3"}},
  {TIM9_BASE, 2, 16, 2, 3, false, REQUEST_NONE, {{ALL_FLAGS, 24}}, {"A2 E5", "A3 E6"}},
  {TIM10_BASE, 2, 16, 1, 3, false, REQUEST_NONE, {{ALL_FLAGS, 25}}, {"B8"}},
  {TIM11_BASE, 2, 16, 1, 3, false, REQUEST_NONE, {{ALL_FLAGS, 26}}, {"B9"}},
};

static uint32_t low_bits(unsigned count) { return count >= 32 ? WORD : (1u << count) - 1; }

static uint32_t compare_flags(const TimVariant *variant) { return low_bits(variant->channels) << 1; }

/* Return the mask of the bits that exist in this timer's register; 0 if the register is missing. */
static uint32_t bits_of(const TimVariant *variant, uint32_t offset) {
  return TIM_EXISTING[variant - VARIANTS][offset >> 2];
}

/* Counter positions at which the flag is set. A compare value above ARR sets the flag at the overflow
 * (12.4.5). CMS selects the direction: 1 down, 2 up, 3 both (12.4.1). */
static void find_matches(const Tim *tim, TimChannel *channel) {
  int64_t compare = channel->compare, arr = tim->arr, *matches = channel->matches;
  uint32_t cms = FIELD(REGISTER(tim, CR1), CR1_CMS);
  int count = 0;
  if (is_input(channel)) {
    count = 0;
  } else if (tim->mode != TIM_CENTRE) {
    int64_t within = tim->mode == TIM_UP ? compare : arr - compare;
    matches[count++] = compare <= arr ? within : 0;
  } else {
    if (cms != 1 && compare) {
      matches[count++] = compare <= arr ? compare : arr;
    }
    if (cms != 2 && compare != arr) {
      matches[count++] = compare < arr && compare ? 2 * arr - compare : 0;
    }
  }
  channel->match_count = (uint8_t)count;
}

static void find_all_matches(Tim *tim) {
  for (int n = 0; n < tim->variant->channels; n++) {
    find_matches(tim, &tim->channels[n]);
  }
}

/* Return INT64_MAX if none of the flags will be set. */
static int64_t steps_to_flags(const Tim *tim, uint32_t flags) {
  int64_t least = INT64_MAX;
  for (int n = 0; n < tim->variant->channels; n++) {
    int64_t steps = flags & flag_of(n) ? steps_to_match(tim, &tim->channels[n]) : INT64_MAX;
    least = steps < least ? steps : least;
  }
  return least;
}

static void raise_compare_flags(Tim *tim, int64_t steps) {
  uint32_t missing = ~REGISTER(tim, SR) & compare_flags(tim->variant);
  for (int n = 0; missing; n++, missing &= ~(flag_of(n) - 1)) {
    if (missing & flag_of(n) && steps_to_flags(tim, flag_of(n)) <= steps) {
      REGISTER(tim, SR) |= flag_of(n);
    }
  }
}

/* -- the counts of ticks --------------------------------------------------------------------------------- */

/* An update counts as a tick if UIE is set. A tick is lost if the flag was already set. A tick is late if more
 * than LATE_AFTER_PS pass until the flag is cleared. */

static void tick_due(Tim *tim) {
  tim->counts.ticks++;
  tim->tick_pending = true;
  tim->tick_ps = tim->peripheral.chip->now_ps;
}

static void tick_handled(Tim *tim) {
  const TimCalls *calls = &tim->peripheral.chip->timers.calls;
  int64_t now_ps = tim->peripheral.chip->now_ps, wait_ps = now_ps - tim->tick_ps, count = tim->missed_ticks;
  tim->tick_pending = false;
  tim->missed_ticks = 0;
  if (wait_ps > LATE_AFTER_PS) {
    tim->counts.late++;
    tim->counts.longest_wait_ps = wait_ps > tim->counts.longest_wait_ps ? wait_ps : tim->counts.longest_wait_ps;
    if (calls->late) {
      calls->late(now_ps, tim->peripheral.index, wait_ps);
    }
  }
  if (count) {
    tim->counts.ticks += count;
    tim->counts.lost += count;
    if (calls->lost) {
      calls->lost(now_ps, tim->peripheral.index, count);
    }
  }
}

static void discard_tick(Tim *tim) {
  tim->tick_pending = false;
  tim->missed_ticks = 0;
}

static void load_preloaded(Tim *tim) {
  if (tim->preload_done) {
    return;
  }
  tim->preload_done = true;
  tim->prescale = REGISTER(tim, PSC) + 1;
  tim->repetition = REGISTER(tim, RCR);
  if (tim->mode == TIM_CENTRE && tim->index) {
    tim->index = REGISTER(tim, ARR); /* the update occurred at the top: continue there, in the falling half */
  }
  set_active_arr(tim, REGISTER(tim, ARR));
  for (int n = 0; n < tim->variant->channels; n++) {
    if (!is_input(&tim->channels[n])) {
      tim->channels[n].compare = REGISTER(tim, CCRx(n + 1));
    }
  }
  find_all_matches(tim);
}

static void raise_update_flag(Tim *tim, int64_t count) {
  if (!(REGISTER(tim, SR) & SR_UIF)) {
    REGISTER(tim, SR) |= SR_UIF;
    count--;
    if (REGISTER(tim, DIER) & DIER_UIE) {
      tick_due(tim);
    }
  }
  if (tim->tick_pending) {
    tim->missed_ticks += count;
  }
}

/* The first update loads the preloaded values. */
static void update(Tim *tim, int64_t count) {
  load_preloaded(tim);
  tim->pulses |= 1 << MASTER_UPDATE;
  tim->repetitions_left = tim->repetition;
  if (tim->one_pulse) {
    REGISTER(tim, CR1) &= ~CR1_CEN;
    tim->running = false;
    tim->base_tick = 0;
  }
  raise_update_flag(tim, count);
  if (REGISTER(tim, DIER) & DIER_UDE) {
    dma_request(tim->peripheral.chip, tim->variant->request);
  }
}

static void set_tick(Tim *tim, int64_t hz) {
  int64_t divisor = gcd(PS_PER_S, hz);
  tim->hz = hz;
  tim->num = PS_PER_S / divisor;
  tim->den = hz / divisor;
  tim->extra = 0;
  tim->by_num = make_divisor(tim->num);
  tim->max_ps = hz ? INT64_MAX / tim->den : 0;
  tim->max_ticks = (INT64_MAX - tim->den) / tim->num;
}

static void set_origin(Tim *tim, int64_t at_ps) {
  tim->origin_ps = at_ps;
  tim->extra = 0;
}

/* Move the origin before times exceed 64 bits. Times do not change. */
static void move_origin(Tim *tim, int64_t now_ps) {
  if (tim->base_tick > 0 && tim->hz && now_ps - tim->origin_ps > tim->max_ps / 2) {
    __int128 passed = (__int128)tim->base_tick * tim->num + tim->extra;
    tim->origin_ps += (int64_t)(passed / tim->den);
    tim->extra = (int64_t)(passed % tim->den);
    tim->base_tick = 0;
  }
}

/* Return the number of the latest tick at now_ps. */
static int64_t ticks_at(const Tim *tim, int64_t now_ps) {
  int64_t after_ps = now_ps - tim->origin_ps + 1;
  if (after_ps > 0 && after_ps <= tim->max_ps) {
    return fast_divide(after_ps * tim->den - 1 - tim->extra, &tim->by_num);
  }
  return tim->hz ? (int64_t)(((__int128)after_ps * tim->den - 1 - tim->extra) / tim->num) : 0;
}

/* Usual numbers need no division. */
static int64_t counts_in(const Tim *tim, int64_t ticks) {
  return tim->prescale == 1 ? ticks : ticks < tim->prescale ? 0 : ticks / tim->prescale;
}

/* The caller makes sure that the counter runs. */
static int64_t time_after(const Tim *tim, int64_t steps) {
  int64_t ticks = tim->base_tick + steps * tim->prescale;
  if (!tim->hz) {
    return NEVER_PS;
  }
  if (ticks <= tim->max_ticks) {
    return tim->origin_ps + (ticks * tim->num + tim->extra) / tim->den;
  }
  __int128 at_ps = tim->origin_ps + ((__int128)ticks * tim->num + tim->extra) / tim->den;
  return at_ps < NEVER_PS ? (int64_t)at_ps : NEVER_PS;
}

/* Call tim_catch_up() first. */
static void change_clock(Tim *tim, int64_t now_ps, int64_t hz) {
  if (tim->running) {
    tim->base_tick -= ticks_at(tim, now_ps);
    set_origin(tim, now_ps);
  }
  set_tick(tim, hz);
}

static void start(Tim *tim, int64_t now_ps) {
  if (!tim->running) {
    tim->running = true;
    set_origin(tim, now_ps);
  }
}

/* Call tim_catch_up() first. The prescaler keeps its phase. */
static void stop(Tim *tim, int64_t now_ps) {
  if (tim->running) {
    tim->running = false;
    tim->base_tick -= ticks_at(tim, now_ps);
  }
}

/* Advance the counter by `steps`. If these steps reach an update, the caller calls update() next. */
static inline void advance(Tim *tim, int64_t steps) {
  if (steps <= 0) {
    return;
  }
  raise_compare_flags(tim, steps);
  if (tim->listened | tim->followed) {
    tim_advance_outputs(tim, steps);
  }
  if (tim->updates_enabled) {
    tim->repetitions_left -= (uint32_t)overflows_in(tim, steps);
  }
  tim->base_tick += steps * tim->prescale;
  tim->index += steps;
  if (tim->index >= tim->cycle_length) {
    tim->index %= tim->cycle_length;
  }
}

/* Skip all whole update periods in one step. All periods are equal, because no preloaded value is left to load. */
static void skip_cycles(Tim *tim, int64_t ticks) {
  if (!tim->running || !tim->preload_done || is_blocked(tim)) {
    return;
  }
  int64_t cycle = (tim->repetition + INT64_C(1)) * tim->overflow_period;
  int64_t whole = (ticks - tim->base_tick) / tim->prescale / cycle;
  if (whole > 0) {
    advance(tim, whole * cycle);
    update(tim, whole);
  }
}

inline void tim_catch_up(Tim *tim) {
  int64_t now_ps = tim->peripheral.chip->now_ps;
  move_origin(tim, now_ps);
  while (tim->running) {
    int64_t ticks = ticks_at(tim, now_ps);
    if (is_blocked(tim)) {
      tim->base_tick = ticks;
      return;
    }
    int64_t steps = counts_in(tim, ticks - tim->base_tick), first = steps_to_update(tim);
    if (steps < first) {
      advance(tim, steps);
      return;
    }
    advance(tim, first);
    update(tim, 1);
    skip_cycles(tim, ticks);
  }
}

/* Predict the next flag, or edge with a listener, but not beyond the next update, which may change compare values. */
static int64_t find_next_ps(const Tim *tim) {
  if (!tim->running || is_blocked(tim)) {
    return NEVER_PS;
  }
  uint32_t missing = ~REGISTER(tim, SR);
  int64_t steps = steps_to_flags(tim, missing & CC_FLAGS);
  if (tim->listened) {
    int64_t edge = tim_steps_to_edge(tim);
    steps = edge < steps ? edge : steps;
  }
  if (steps < INT64_MAX || missing & SR_UIF || tim->one_pulse || REGISTER(tim, DIER) & DIER_UDE) {
    int64_t first = steps_to_update(tim);
    steps = first < steps ? first : steps;
  }
  return steps < INT64_MAX ? time_after(tim, steps) : NEVER_PS;
}

static int64_t next_ps(Tim *tim) {
  if (!tim->next_known) {
    tim->next_known = true;
    tim->next_ps = find_next_ps(tim);
  }
  return tim->next_ps;
}

inline void tim_reschedule(Tim *tim) {
  Chip *chip = tim->peripheral.chip;
  uint32_t status = REGISTER(tim, SR), enabled = REGISTER(tim, DIER), active = status & enabled;
  bool wanted = enabled & ~status & (SR_UIF | CC_FLAGS) || enabled & DIER_UDE || tim->listened;
  tim->next_known = false;
  if (tim->listened) {
    tim_report_edges(tim);
  }
  int64_t at_ps = wanted ? next_ps(tim) : NEVER_PS;
  if (at_ps >= NEVER_PS) {
    event_cancel(chip, tim->event);
  } else if (at_ps != event_at(chip, tim->event)) {
    event_schedule(chip, tim->event, at_ps);
  }
  for (const TimIrq *irq = tim->variant->irqs; irq < tim->variant->irqs + 4 && irq->flags; irq++) {
    peripheral_set_irq(&tim->peripheral, irq->number, (active & irq->flags) != 0);
  }
}

static void sync(Tim *tim) {
  tim_catch_up(tim);
  tim_reschedule(tim);
}

static void on_event(Peripheral *peripheral) { sync((Tim *)peripheral); }

/* Return the time of the next flag that the counter or an oscillator's edge sets. */
static int64_t next_flag_ps(Tim *tim) {
  int64_t at_ps = next_ps(tim);
  int64_t edge_ps = tim->edge_event < 0 ? NEVER_PS : event_at(tim->peripheral.chip, tim->edge_event);
  return at_ps < edge_ps ? at_ps : edge_ps;
}

static bool is_ccr(uint32_t offset) { return offset >= CCRx(1) && offset <= CCRx(4); }

/* Call tim_catch_up() first. */
static uint32_t value_of(const Tim *tim, uint32_t offset) {
  if (offset == CNT) {
    return (uint32_t)cnt_of(tim);
  }
  if (offset == CR1 && tim->mode == TIM_CENTRE) {
    return (REGISTER(tim, CR1) & ~CR1_DIR) | (is_falling(tim) ? CR1_DIR : 0);
  }
  return REGISTER(tim, offset);
}

Tim tim_at_present(const Tim *tim) {
  Tim now = *tim;
  /* In the copy DIER is 0, so that it causes no DMA request and no tick. No request or tick is lost: each enabled flag
     has an event, and no event is due. */
  REGISTER(&now, DIER) = 0;
  tim_catch_up(&now);
  REGISTER(&now, DIER) = REGISTER(tim, DIER);
  return now;
}

static uint32_t tim_peek(const Peripheral *peripheral, uint32_t offset) {
  Tim now = tim_at_present((const Tim *)peripheral);
  return value_of(&now, offset);
}

/* Section 12.4.5. */
static void read_capture(Tim *tim, int channel) {
  if (is_input(&tim->channels[channel]) && REGISTER(tim, SR) & flag_of(channel)) {
    REGISTER(tim, SR) &= ~flag_of(channel);
    tim_reschedule(tim);
  }
}

/* CNT and DIR change continuously. Reads of capture registers have side effects. */
static bool tim_is_pure(const Peripheral *peripheral, uint32_t offset) {
  const Tim *tim = (const Tim *)peripheral;
  return offset != CNT && !is_ccr(offset) && !(offset == CR1 && tim->mode == TIM_CENTRE);
}

/* The values of SR and CR1 are valid until the next flag. */
static uint32_t tim_read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  Tim *tim = (Tim *)peripheral;
  bool runs = !tim_is_pure(peripheral, offset);
  bool flags = offset == SR || offset == CR1;
  if (runs || (flags && peripheral->chip->now_ps >= next_ps(tim))) {
    sync(tim);
  }
  *until_ps = runs ? NOT_CACHEABLE_PS : flags ? next_flag_ps(tim) : NEVER_PS;
  uint32_t value = value_of(tim, offset);
  if (is_ccr(offset)) {
    read_capture(tim, (int)(offset - CCRx(1)) / 4);
  }
  return value;
}

/* Handle a change of CR1 or ARR. CNT keeps its value. */
static void cr1_changed(Tim *tim) {
  uint32_t cr1 = REGISTER(tim, CR1);
  int64_t now_ps = tim->peripheral.chip->now_ps, value = cnt_of(tim);
  bool falling = is_falling(tim);
  tim->mode = FIELD(cr1, CR1_CMS) ? TIM_CENTRE : cr1 & CR1_DIR ? TIM_DOWN : TIM_UP;
  set_active_arr(tim, cr1 & CR1_ARPE ? tim->arr : REGISTER(tim, ARR));
  set_cnt(tim, value, falling);
  find_all_matches(tim);
  tim->updates_enabled = !(cr1 & CR1_UDIS);
  tim->one_pulse = (cr1 & CR1_OPM) != 0;
  if (cr1 & CR1_CEN) {
    start(tim, now_ps);
  } else {
    stop(tim, now_ps);
  }
}

static void dier_changed(Tim *tim) {
  uint32_t dier = REGISTER(tim, DIER);
  if (dier & CC_DMA) {
    peripheral_note(&tim->peripheral, NOTE_DIER, NOTE_NOT_MODELLED,
                    "capture-dma | DIER: DMA requests on capture and compare");
  }
  if (!(dier & DIER_UIE)) {
    discard_tick(tim);
  } else if (REGISTER(tim, SR) & SR_UIF && !tim->tick_pending) {
    tick_due(tim);
  }
}

/* Without OCxPE the new value becomes active immediately (12.4.7). */
static void compare_changed(Tim *tim, int number) {
  TimChannel *channel = &tim->channels[number];
  if (is_input(channel) || !(channel->settings & CCMR1_OC1PE)) {
    channel->compare = REGISTER(tim, CCRx(number + 1));
    find_matches(tim, channel);
  }
}

static void channels_changed(Tim *tim) {
  for (int n = 0; n < tim->variant->channels; n++) {
    uint8_t settings = (uint8_t)(REGISTER(tim, n < 2 ? CCMR1 : CCMR2) >> 8 * (n & 1));
    tim_set_output(tim, n, settings, REGISTER(tim, CCER) >> 4 * n & 0xF);
    compare_changed(tim, n);
  }
  find_all_matches(tim);
}

/* Section 12.4.6. */
static void generate_events(Tim *tim, uint32_t events) {
  if (events & EGR_UG) {
    tim->pulses |= 1 << MASTER_RESET;
    if (!(REGISTER(tim, CR1) & CR1_UDIS)) {
      tim->pulses |= 1 << MASTER_UPDATE;
      load_preloaded(tim);
      if (!(REGISTER(tim, CR1) & CR1_URS)) {
        raise_update_flag(tim, 1);
      }
    }
    tim->index = 0;
    tim->base_tick = tim->running ? ticks_at(tim, tim->peripheral.chip->now_ps) : 0;
    tim->repetitions_left = tim->repetition;
  }
  for (int n = 0; n < tim->variant->channels; n++) {
    if (events & flag_of(n) && is_input(&tim->channels[n])) {
      tim_capture(tim, n);
    } else if (events & flag_of(n)) {
      REGISTER(tim, SR) |= flag_of(n);
      tim->pulses |= n == 0 ? 1 << MASTER_COMPARE : 0;
    }
  }
  REGISTER(tim, SR) |= events & (COM_TRIGGER | SR_BIF);
}

static void register_changed(Tim *tim, uint32_t offset) {
  Peripheral *peripheral = &tim->peripheral;
  if (offset == CR1 || offset == ARR) {
    cr1_changed(tim);
  } else if (offset == DIER) {
    dier_changed(tim);
  } else if (is_ccr(offset)) {
    compare_changed(tim, (int)(offset - CCRx(1)) / 4);
  } else if (offset == CCMR1 || offset == CCMR2 || offset == CCER) {
    channels_changed(tim);
  } else if (offset == SMCR && REGISTER(tim, SMCR) & ECE_SMS) {
    peripheral_note(peripheral, NOTE_SMCR, NOTE_NOT_MODELLED,
                    "slave-mode | SMCR: slave mode or external clock; the counter runs freely");
  } else if (offset == DCR) {
    peripheral_note(peripheral, NOTE_DCR, NOTE_NOT_MODELLED, "dma-burst register=DCR | DCR: DMA bursts");
  } else if (offset == DMAR) {
    peripheral_note(peripheral, NOTE_DMAR, NOTE_NOT_MODELLED, "dma-burst register=DMAR | DMAR: DMA bursts");
  }
}

static void clear_flags(Tim *tim, uint32_t kept) {
  REGISTER(tim, SR) &= kept;
  if (tim->tick_pending && !(REGISTER(tim, SR) & SR_UIF)) {
    tick_handled(tim);
  }
}

static void tim_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Tim *tim = (Tim *)peripheral;
  mask &= bits_of(tim->variant, offset);
  if (!mask) {
    return;
  }
  peripheral->chip->work += WORK_TIMER;
  tim_catch_up(tim);
  value &= mask;
  tim->preload_done = tim->preload_done && offset == SR;
  if (offset == SR) {
    clear_flags(tim, ~mask | value);
  } else if (offset == EGR) {
    generate_events(tim, value);
  } else if (offset == CNT) {
    set_cnt(tim, ((uint32_t)cnt_of(tim) & ~mask) | value, is_falling(tim));
  } else {
    REGISTER(tim, offset) = (REGISTER(tim, offset) & ~mask) | value;
    register_changed(tim, offset);
    tim_schedule_edge(tim);
  }
  tim_reschedule(tim);
}

static int64_t input_hz(const Tim *tim) {
  const Clocks *clocks = &tim->peripheral.chip->clocks;
  return tim->variant->apb == 1 ? clocks->timer1_hz : clocks->timer2_hz;
}

static void tim_clocks_changed(Peripheral *peripheral) {
  Tim *tim = (Tim *)peripheral;
  int64_t hz = input_hz(tim);
  if (hz != tim->hz) {
    tim_catch_up(tim);
    change_clock(tim, peripheral->chip->now_ps, hz);
    tim_reschedule(tim);
  }
}

/* A reset keeps the counts of ticks. */
static void tim_reset(Peripheral *peripheral) {
  Tim *tim = (Tim *)peripheral;
  memcpy(tim->registers, TIM_RESETS[tim->variant - VARIANTS], sizeof tim->registers);
  memset(tim->channels, 0, sizeof tim->channels);
  tim->followed = tim->latched = tim->pulses = 0;
  tim->mode = TIM_UP;
  tim->index = 0;
  set_active_arr(tim, REGISTER(tim, ARR));
  set_tick(tim, input_hz(tim));
  set_origin(tim, 0);
  tim->base_tick = 0;
  tim->prescale = 1;
  tim->repetition = tim->repetitions_left = 0;
  tim->running = tim->one_pulse = tim->preload_done = false;
  tim->updates_enabled = true;
  channels_changed(tim);
  discard_tick(tim);
  tim_reschedule(tim);
  tim_schedule_edge(tim);
}

static const PeripheralType TIM = {
  .read = tim_read,
  .peek = tim_peek,
  .write = tim_write,
  .reset = tim_reset,
  .clocks_changed = tim_clocks_changed,
  .is_pure = tim_is_pure,
};

/* All timers have the registers of TIM1, because HAL also writes to registers that smaller timers lack.
 * Bits that do not exist read as 0. */
void timers_create(Chip *chip) {
  for (int n = 0; n < TIMERS; n++) {
    Tim *tim = &chip->timers.timers[n];
    peripheral_create(chip, &tim->peripheral, &TIM, VARIANTS[n].base, TIM1_SIZE, TIM_OFFSETS);
    tim->variant = &VARIANTS[n];
    tim->event = event_create(&tim->peripheral, on_event);
    tim->edge_event = tim->variant->base == TIM5_BASE ? event_create(&tim->peripheral, tim_oscillator_edge) : -1;
    tim_reset(&tim->peripheral);
  }
}

static const Tim *timer_of(const Chip *chip, int32_t index) { return (const Tim *)chip->peripherals[index]; }

void fcu_connect_timers(Chip *chip, const TimCalls *calls) { chip->timers.calls = *calls; }

const TickCounts *fcu_timer_counts(const Chip *chip, int32_t index) { return &timer_of(chip, index)->counts; }

double fcu_timer_rate(const Chip *chip, int32_t index) {
  Tim now = tim_at_present(timer_of(chip, index));
  int64_t ticks = now.prescale * now.overflow_period * (now.repetition + INT64_C(1));
  return is_blocked(&now) ? 0.0 : (double)now.hz / (double)ticks;
}

int64_t fcu_timer_next_change(const Chip *chip, int32_t index) {
  Tim now = tim_at_present(timer_of(chip, index));
  now.next_known = false;
  return next_flag_ps(&now);
}
