/* The variants of the timers, and the arithmetic of their counters (RM0368 sections 12.3.2, 13.3.2).
 *
 * Used by tim.c, tim_inputs.c and tim_outputs.c only.
 */
#ifndef FCU_TIM_COUNTER_H
#define FCU_TIM_COUNTER_H

#include "chip.h"
#include "generated/registers_tim.h"

#define REGISTER(tim, offset) ((tim)->registers[(offset) >> 2])

/* Flags of SR. */
#define CC_FLAGS (SR_CC1IF | SR_CC2IF | SR_CC3IF | SR_CC4IF)
/* Masks at the position of channel 1. */
#define CCS(settings) FIELD(settings, CCMR1_CC1S)
#define OCM(settings) FIELD(settings, CCMR1_OC1M)

/* Codes of CR2.MMS, the source of the trigger output (12.4.2). Codes from MASTER_OUTPUT on are output references. */
enum { MASTER_RESET, MASTER_ENABLE, MASTER_UPDATE, MASTER_COMPARE, MASTER_OUTPUT };

typedef struct {
  uint8_t flags, number; /* bits of SR, and the NVIC input that they raise */
} TimIrq;

typedef struct TimVariant {
  uint32_t base;
  uint8_t apb, bits, channels, alternate;
  bool advanced;
  enum Request request;
  TimIrq irqs[4];                 /* an entry with flags 0 ends the list */
  const char *pins[TIM_CHANNELS]; /* "A8 E9" */
} TimVariant;

/* index is a position in a cycle (12.3.2, 13.3.2). When the timer counts up, index is the value of CNT. When
 * it counts down, index is the distance from ARR. A centre-aligned cycle goes from 0 to ARR and back to 0 in
 * 2 * ARR counts. The arrival at 0 is an overflow or underflow; in centre-aligned mode, so is the arrival at
 * ARR.
 *
 * A negative index is outside of the cycle, because ARR was set below the counter. An upcounter then
 * continues to its largest value and wraps without an event. A downcounter moves back into the cycle. The
 * manual does not document this case for the centre-aligned mode; here the model counts up. */

static inline int64_t modulus(const Tim *tim) { return INT64_C(1) << tim->variant->bits; }

/* Section 12.3.2. */
static inline bool is_blocked(const Tim *tim) { return tim->arr == 0; }

static inline void set_active_arr(Tim *tim, int64_t arr) {
  tim->arr = arr;
  tim->overflow_period = tim->mode == TIM_CENTRE ? arr : arr + 1;
  tim->cycle_length = tim->mode == TIM_CENTRE ? 2 * arr : arr + 1;
}

static inline int64_t cnt_of(const Tim *tim) {
  if (tim->mode == TIM_DOWN) {
    return tim->arr - tim->index;
  }
  if (tim->index < 0) {
    return tim->index + modulus(tim);
  }
  return tim->index > tim->arr ? 2 * tim->arr - tim->index : tim->index;
}

static inline bool is_falling(const Tim *tim) {
  return tim->mode == TIM_DOWN || (tim->mode == TIM_CENTRE && tim->index >= tim->arr);
}

/* Parameter falling affects the centre-aligned mode only. */
static inline void set_cnt(Tim *tim, int64_t value, bool falling) {
  if (tim->mode == TIM_DOWN) {
    tim->index = tim->arr - value;
  } else if (value > tim->arr) {
    tim->index = value - modulus(tim);
  } else if (tim->mode == TIM_CENTRE && falling && value) {
    tim->index = 2 * tim->arr - value;
  } else {
    tim->index = value;
  }
}

/* The caller makes sure that the counter is not blocked. */
static inline int64_t steps_to_overflow(const Tim *tim) {
  bool within = tim->index < tim->overflow_period; /* usually true; otherwise a slow division is needed */
  return tim->overflow_period - (within ? tim->index : tim->index % tim->overflow_period);
}

/* Return INT64_MAX if no update will come. */
static inline int64_t steps_to_update(const Tim *tim) {
  if (!tim->updates_enabled || is_blocked(tim)) {
    return INT64_MAX;
  }
  return steps_to_overflow(tim) + tim->repetitions_left * tim->overflow_period;
}

static inline int64_t overflows_in(const Tim *tim, int64_t steps) {
  int64_t first = steps_to_overflow(tim);
  return steps < first ? 0 : 1 + (steps - first) / tim->overflow_period;
}

static inline int64_t steps_to(const Tim *tim, int64_t position) {
  int64_t steps = position - tim->index;
  return steps > 0 || tim->index < 0 ? steps : steps + tim->cycle_length;
}

static inline uint32_t flag_of(int channel) { return 2u << channel; }

static inline bool is_input(const TimChannel *channel) { return CCS(channel->settings) != 0; }

/* Return the number of steps until the channel's flag is set; INT64_MAX: never. */
static inline int64_t steps_to_match(const Tim *tim, const TimChannel *channel) {
  int64_t least = INT64_MAX;
  for (int match = 0; match < channel->match_count; match++) {
    int64_t steps = steps_to(tim, channel->matches[match]);
    least = steps < least ? steps : least;
  }
  return least;
}

/* tim.c */
void tim_catch_up(Tim *tim); /* Call this before the timer's state is read or changed. */
/* Schedule the event of the next flag, and set the interrupt lines. Call this after a change. */
void tim_reschedule(Tim *tim);
Tim tim_at_present(const Tim *tim); /* Return a copy at the current time, without effects on the chip. */

/* tim_outputs.c */
/* Set the channel's mode and enable bits (a byte of CCMR, four bits of CCER). */
void tim_set_output(Tim *tim, int channel, uint8_t settings, uint8_t enable);
/* Call this before the counter advances by `steps`, if any signal has a listener or a channel is followed. */
void tim_advance_outputs(Tim *tim, int64_t steps);
/* Return the number of steps until a signal with a listener may change; INT64_MAX: never. */
int64_t tim_steps_to_edge(const Tim *tim);
/* Report the edges of signals with listeners since the latest call. */
void tim_report_edges(Tim *tim);

/* tim_inputs.c */
void tim_capture(Tim *tim, int channel);
void tim_schedule_edge(Tim *tim); /* the next edge of an oscillator at input 4 of TIM5 */
void tim_oscillator_edge(Peripheral *peripheral);

#endif
