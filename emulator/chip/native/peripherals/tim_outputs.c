/* Outputs of the timers: levels of the compare channels, the trigger output, and PWM (RM0368 sections 12.3.8, 12.3.9,
 * 12.4.2).
 *
 * OCxREF in PWM mode is a function of the counter. In modes in which matches change its level, `latched` contains it.
 * Edges are searched and reported only for signals to which another peripheral listens.
 *
 * A channel's signal is the level of its output: OCxREF with polarity, and 0 while the output is disabled (CCxE; of
 * TIM1 also MOE). The manual does not describe this; see efton.sk/STM32/gotcha/g89.html.
 *
 * NOT MODELLED, silent: break input, dead time; OCxCE; outputs as levels of pins.
 */
#include "fcu.h"

#include "peripherals/tim_counter.h"

enum { FROZEN, ACTIVE_ON_MATCH, INACTIVE_ON_MATCH, TOGGLE, FORCED_LOW, FORCED_HIGH, PWM1, PWM2 };

static uint32_t mode_of(const TimChannel *channel) { return OCM(channel->settings); }

static uint32_t master_mode(const Tim *tim) { return FIELD(REGISTER(tim, CR2), CR2_MMS); }

/* -- levels ------------------------------------------------------------------------------------------------ */

/* PWM mode 1 is active while CNT < CCR; when the timer counts down, while CNT <= CCR (12.3.9). */
static bool is_below(const Tim *tim, const TimChannel *channel) {
  int64_t value = cnt_of(tim), compare = channel->compare;
  return is_falling(tim) ? value <= compare : value < compare;
}

/* Return OCxREF; false for an input. */
static bool reference_of(const Tim *tim, int n) {
  const TimChannel *channel = &tim->channels[n];
  uint32_t mode = mode_of(channel);
  if (is_input(channel)) {
    return false;
  }
  if (mode >= PWM1) {
    return is_below(tim, channel) == (mode == PWM1);
  }
  return mode >= FORCED_LOW ? mode == FORCED_HIGH : tim->latched >> n & 1;
}

static bool is_off(const Tim *tim) { return tim->variant->advanced && !(REGISTER(tim, BDTR) & BDTR_MOE); }

static bool output_of(const Tim *tim, int n) {
  uint8_t enable = tim->channels[n].enable;
  return enable & CCER_CC1E && !is_off(tim) && !is_input(&tim->channels[n]) &&
         reference_of(tim, n) != ((enable & CCER_CC1P) != 0);
}

/* Levels of the trigger output; pulses are reported separately. */
static bool trigger_output_of(const Tim *tim) {
  uint32_t mode = master_mode(tim);
  return mode >= MASTER_OUTPUT ? reference_of(tim, (int)mode - MASTER_OUTPUT) : mode == MASTER_ENABLE && tim->running;
}

static uint8_t levels_of(const Tim *tim) {
  unsigned levels = trigger_output_of(tim) ? 1u << TIM_TRGO : 0;
  for (int n = 0; n < TIM_CHANNELS; n++) {
    levels |= tim->listened >> n & 1 && output_of(tim, n) ? 1u << n : 0;
  }
  return (uint8_t)levels;
}

/* A new mode starts with the present level, because a frozen output keeps it (12.4.7, OCxM). */
void tim_set_output(Tim *tim, int n, uint8_t settings, uint8_t enable) {
  TimChannel *channel = &tim->channels[n];
  uint32_t bit = 1u << n, mode = OCM(settings);
  if (channel->settings != settings) {
    bool followed = !CCS(settings) && mode >= ACTIVE_ON_MATCH && mode <= TOGGLE;
    tim->latched = (uint8_t)((tim->latched & ~bit) | (reference_of(tim, n) ? bit : 0));
    tim->followed = (uint8_t)((tim->followed & ~bit) | (followed ? bit : 0));
  }
  channel->settings = settings;
  channel->enable = enable;
}

/* -- edges ------------------------------------------------------------------------------------------------- */

/* Return INT64_MAX if the counter will not arrive at the position. */
static int64_t steps_to_position(const Tim *tim, int64_t position) {
  int64_t steps = position - tim->index;
  if (position >= tim->cycle_length || (steps <= 0 && position < 0)) {
    return INT64_MAX;
  }
  return steps > 0 ? steps : steps + tim->cycle_length;
}

/* Write the positions at which CNT arrives at CCR, and return their number. While CNT is above ARR, it arrives at CCR
 * once at a negative position. */
static int equal_positions(const Tim *tim, const TimChannel *channel, int64_t positions[2]) {
  int64_t compare = channel->compare;
  if (tim->mode == TIM_DOWN) {
    positions[0] = tim->arr - compare;
    return 1;
  }
  if (compare > tim->arr) {
    positions[0] = compare - modulus(tim);
    return 1;
  }
  positions[0] = compare;
  positions[1] = 2 * tim->arr - compare;
  return tim->mode == TIM_CENTRE && positions[1] != compare ? 2 : 1;
}

static int64_t matches_in(const Tim *tim, const TimChannel *channel, int64_t steps) {
  int64_t positions[2], matches = 0;
  int count = equal_positions(tim, channel, positions);
  for (int n = 0; n < count; n++) {
    int64_t first = steps_to_position(tim, positions[n]);
    bool repeats = positions[n] >= 0;
    matches += steps < first ? 0 : repeats ? 1 + (steps - first) / tim->cycle_length : 1;
  }
  return matches;
}

static bool latch_after(const Tim *tim, int n, int64_t matches) {
  switch (mode_of(&tim->channels[n])) {
  case ACTIVE_ON_MATCH: return true;
  case INACTIVE_ON_MATCH: return false;
  default: return (tim->latched >> n & 1) != (matches & 1);
  }
}

void tim_advance_outputs(Tim *tim, int64_t steps) {
  for (int n = 0; tim->followed >> n; n++) {
    int64_t matches = tim->followed >> n & 1 ? matches_in(tim, &tim->channels[n], steps) : 0;
    if (matches) {
      unsigned level = latch_after(tim, n, matches);
      tim->latched = (uint8_t)((tim->latched & ~(1u << n)) | level << n);
    }
  }
  if (tim->listened >> TIM_TRGO & 1 && steps_to_match(tim, &tim->channels[0]) <= steps) {
    tim->pulses |= 1 << MASTER_COMPARE;
  }
}

static int64_t least_of(int64_t one, int64_t other) { return one < other ? one : other; }

/* An update may load another compare value. */
static int64_t steps_to_level(const Tim *tim, int n) {
  const TimChannel *channel = &tim->channels[n];
  uint32_t mode = mode_of(channel);
  int64_t positions[2], least = INT64_MAX;
  if (is_input(channel) || !(mode >= PWM1 || tim->followed >> n & 1)) {
    return INT64_MAX;
  }
  for (int count = equal_positions(tim, channel, positions); count > 0; count--) {
    least = least_of(least, steps_to_position(tim, positions[count - 1]));
  }
  least = mode >= PWM1 ? least_of(least, steps_to_position(tim, 0)) : least;
  return tim->preload_done ? least : least_of(least, steps_to_update(tim));
}

static int64_t steps_to_trigger(const Tim *tim) {
  uint32_t mode = master_mode(tim);
  switch (mode) {
  case MASTER_RESET: /* these edges come from writes, or from the end of a one-pulse run, which always has an event */
  case MASTER_ENABLE: return INT64_MAX;
  case MASTER_UPDATE: return steps_to_update(tim);
  case MASTER_COMPARE: return steps_to_match(tim, &tim->channels[0]);
  default: return steps_to_level(tim, (int)mode - MASTER_OUTPUT);
  }
}

int64_t tim_steps_to_edge(const Tim *tim) {
  int64_t least = tim->listened >> TIM_TRGO & 1 ? steps_to_trigger(tim) : INT64_MAX;
  for (int n = 0; n < TIM_CHANNELS; n++) {
    least = tim->listened >> n & 1 ? least_of(least, steps_to_level(tim, n)) : least;
  }
  return least;
}

static int number_of(const Tim *tim) { return (int)(tim - tim->peripheral.chip->timers.timers) + 1; }

void tim_report_edges(Tim *tim) {
  Chip *chip = tim->peripheral.chip;
  uint8_t levels = levels_of(tim), changed = (levels ^ tim->signals) & tim->listened;
  bool pulse = tim->listened >> TIM_TRGO & tim->pulses >> master_mode(tim) & 1;
  tim->signals = levels;
  tim->pulses = 0;
  for (int signal = 0; changed >> signal; signal++) {
    if (changed >> signal & 1) {
      adc_timer_signal(chip, number_of(tim), signal, levels >> signal & 1);
    }
  }
  if (pulse) {
    adc_timer_signal(chip, number_of(tim), TIM_TRGO, true);
    adc_timer_signal(chip, number_of(tim), TIM_TRGO, false);
  }
}

/* -- listeners --------------------------------------------------------------------------------------------- */

void timers_listen(Chip *chip, int number, enum TimSignal signal) {
  Tim *tim = &chip->timers.timers[number - 1];
  tim_catch_up(tim);
  tim->listened |= (uint8_t)(1u << signal);
  tim->signals = levels_of(tim);
  tim->pulses = 0;
  tim_reschedule(tim);
}

void timers_ignore_all(Chip *chip) {
  for (Tim *tim = chip->timers.timers; tim < chip->timers.timers + TIMERS; tim++) {
    if (tim->listened) {
      tim->listened = 0;
      tim_reschedule(tim);
    }
  }
}

/* -- PWM --------------------------------------------------------------------------------------------------- */

static double duty_below(const Tim *tim, uint32_t compare) {
  double cycle = tim->mode == TIM_CENTRE ? (double)tim->arr : (double)tim->arr + 1;
  double share = (tim->mode == TIM_DOWN ? compare + 1.0 : compare) / cycle;
  return share < 1 ? share : 1;
}

/* Return a negative number if the channel has neither PWM nor a constant level. */
static double duty_of(const Tim *tim, const TimChannel *channel) {
  uint32_t mode = mode_of(channel);
  double active;
  if (is_input(channel) || !(channel->enable & CCER_CC1E)) {
    return -1;
  }
  if (mode == FORCED_LOW || mode == FORCED_HIGH) {
    active = mode == FORCED_HIGH;
  } else if (mode >= PWM1 && tim->arr) {
    active = duty_below(tim, channel->compare);
    active = mode == PWM2 ? 1 - active : active;
  } else {
    return -1;
  }
  return channel->enable & CCER_CC1P ? 1 - active : active;
}

int32_t fcu_timer_pwm(const Chip *chip, int32_t index, int32_t channel, double *frequency_hz, double *duty) {
  Tim now = tim_at_present((const Tim *)chip->peripherals[index]);
  if (channel < 1 || channel > now.variant->channels) {
    return -1;
  }
  int halves = now.mode == TIM_CENTRE ? 2 : 1;
  *duty = duty_of(&now, &now.channels[channel - 1]);
  *frequency_hz = is_blocked(&now) ? 0 : (double)now.hz / (double)(now.prescale * now.overflow_period * halves);
  return *duty >= 0 && !is_off(&now) && now.running && !is_blocked(&now);
}
