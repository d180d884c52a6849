/* Inputs of the timers: captures of edges at pins and of oscillators (RM0368 sections 12.3.6, 13.4.21).
 *
 * NOT MODELLED, silent: input filters; CCxS = 3.
 */
#include "peripherals/tim_counter.h"

#define ICPSC(settings) FIELD(settings, CCMR1_IC1PSC)

/* Return -1 if the pin has no channel. */
static int channel_of_pin(const TimVariant *variant, char port, int pin) {
  for (int channel = 0; channel < variant->channels; channel++) {
    for (const char *name = variant->pins[channel]; *name;) {
      char letter = *name++;
      int number = 0;
      for (; *name && *name != ' '; name++) {
        number = 10 * number + *name - '0';
      }
      name += *name == ' ';
      if (letter == port && number == pin) {
        return channel;
      }
    }
  }
  return -1;
}

/* Section 12.3.6. */
void tim_capture(Tim *tim, int channel) {
  if (REGISTER(tim, SR) & flag_of(channel)) {
    REGISTER(tim, SR) |= flag_of(channel) << 8;
  }
  REGISTER(tim, SR) |= flag_of(channel);
  tim->pulses |= channel == 0 ? 1 << MASTER_COMPARE : 0;
  REGISTER(tim, CCRx(channel + 1)) = (uint32_t)cnt_of(tim);
}

/* Return whether the channel captures input `source`: its own input (CCxS = 1) or its neighbour's (CCxS =
 * 2). */
static bool listens_to(const TimChannel *channel, int number, int source) {
  uint32_t selected = CCS(channel->settings);
  return (selected == 1 && source == number) || (selected == 2 && source == (number ^ 1));
}

/* Check polarity (CCxP, CCxNP) and prescaler (ICxPSC). */
static bool captures(TimChannel *channel, bool level) {
  const uint32_t both_edges = CCER_CC1P | CCER_CC1NP;
  bool both = (channel->enable & both_edges) == both_edges, rising = !(channel->enable & CCER_CC1P);
  if (!(channel->enable & CCER_CC1E) || (!both && level != rising)) {
    return false;
  }
  if (++channel->edges < 1u << ICPSC(channel->settings)) {
    return false;
  }
  channel->edges = 0;
  return true;
}

/* -- TIM5: an oscillator at input 4 (13.4.21) --------------------------------------------------------------- */

#define OSCILLATOR_INPUT 3
enum { REMAP_LSI = 1, REMAP_LSE = 2 };

/* Return 0 if the input is connected to the pin or to nothing. */
static int64_t oscillator_hz(const Tim *tim) {
  const Clocks *clocks = &tim->peripheral.chip->clocks;
  uint32_t remap = FIELD(REGISTER(tim, OR), OR_TI4_RMP);
  if (tim->edge_event < 0) {
    return 0;
  }
  return remap == REMAP_LSI ? clocks->lsi_hz : remap == REMAP_LSE ? clocks->lse_hz : 0;
}

static bool is_remapped(const Tim *tim, int source) {
  return tim->edge_event >= 0 && source == OSCILLATOR_INPUT && REGISTER(tim, OR) & OR_TI4_RMP;
}

/* Return the channels that capture the edges of this input, as flags of SR. */
static uint32_t oscillator_flags(const Tim *tim) {
  uint32_t flags = 0;
  for (int n = 0; n < tim->variant->channels; n++) {
    const TimChannel *channel = &tim->channels[n];
    flags |= listens_to(channel, n, OSCILLATOR_INPUT) && channel->enable & CCER_CC1E ? flag_of(n) : 0;
  }
  return flags;
}

/* The number of edges since power-on; edges with even numbers rise. */
static int64_t edges_until(int64_t now_ps, int64_t hz) { return (int64_t)((__int128)now_ps * 2 * hz / PS_PER_S); }

void tim_schedule_edge(Tim *tim) {
  Chip *chip = tim->peripheral.chip;
  int64_t hz = oscillator_hz(tim);
  uint32_t flags = hz ? oscillator_flags(tim) : 0;
  if (tim->edge_event < 0) {
    return;
  }
  if (!flags) {
    event_cancel(chip, tim->edge_event);
    return;
  }
  __int128 next = edges_until(chip->now_ps, hz) + 1;
  int64_t at_ps = (int64_t)((next * PS_PER_S + 2 * hz - 1) / (2 * hz));
  (REGISTER(tim, DIER) & flags ? event_schedule : event_defer)(chip, tim->edge_event, at_ps);
}

/* -- edges ------------------------------------------------------------------------------------------------- */

static void capture_edge(Tim *tim, int source, bool level) {
  tim_catch_up(tim);
  for (int n = 0; n < tim->variant->channels; n++) {
    if (listens_to(&tim->channels[n], n, source) && captures(&tim->channels[n], level)) {
      tim_capture(tim, n);
    }
  }
  tim_reschedule(tim);
}

void tim_oscillator_edge(Peripheral *peripheral) {
  Tim *tim = (Tim *)peripheral;
  int64_t hz = oscillator_hz(tim);
  if (hz) {
    capture_edge(tim, OSCILLATOR_INPUT, edges_until(peripheral->chip->now_ps, hz) % 2 == 0);
  }
  tim_schedule_edge(tim);
}

void timers_oscillators_changed(Chip *chip) {
  for (int timer = 0; timer < TIMERS; timer++) {
    tim_schedule_edge(&chip->timers.timers[timer]);
  }
}

void timers_pin_changed(Chip *chip, int port, int pin, bool level) {
  int function = chip->alternate[port][pin];
  for (int timer = 0; function > 0 && timer < TIMERS; timer++) {
    Tim *tim = &chip->timers.timers[timer];
    int source = tim->variant->alternate == function ? channel_of_pin(tim->variant, "ABCDEH"[port], pin) : -1;
    if (source < 0 || is_remapped(tim, source)) {
      continue;
    }
    capture_edge(tim, source, level);
  }
}
