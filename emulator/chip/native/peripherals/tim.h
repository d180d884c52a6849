/* One timer; tim.c explains it. */
#ifndef FCU_TIM_H
#define FCU_TIM_H

#include "peripherals/peripheral.h"
#include "cpu/division.h"

#define TIMERS 8
#define TIM_CHANNELS 4

/* Counts of update interrupts, for the run's summary. */
typedef struct {
  int64_t ticks;           /* updates while the update interrupt was enabled */
  int64_t late;            /* ticks whose handler came late */
  int64_t lost;            /* ticks at which the flag of the previous one was still set */
  int64_t longest_wait_ps; /* the longest time between a late tick and its handler */
} TickCounts;

typedef struct {
  uint8_t settings;     /* this channel's byte of CCMR */
  uint8_t enable;       /* its four bits of CCER: E, P, NE, NP */
  uint8_t edges;        /* since the last capture */
  uint8_t match_count;
  uint32_t compare;     /* the active compare value */
  int64_t matches[2];   /* positions of the counter's cycle where the compare flag is raised */
} TimChannel;

enum TimMode { TIM_UP, TIM_DOWN, TIM_CENTRE };

typedef struct {
  Peripheral peripheral;
  const struct TimVariant *variant;
  int32_t event;
  uint32_t registers[21]; /* by offset / 4, without CNT */

  /* The counter: see "the counter" in tim.c. */
  enum TimMode mode;
  int64_t index, arr; /* arr: the active one */
  int64_t overflow_period;    /* counts from one overflow or underflow to the next */
  int64_t cycle_length;     /* of the cycle */

  /* The time base: tick k of the timer's clock is at origin_ps + (k * num + extra) / den, rounded down once. */
  int64_t hz, num, den, extra; /* extra is smaller than den */
  Divisor by_num;
  int64_t max_ps, max_ticks; /* the limit below which 64 bits suffice for products */
  int64_t origin_ps;
  int64_t base_tick; /* the tick of the counter's last change; while stopped, minus the phase */
  uint32_t prescale, repetition, repetitions_left; /* active PSC + 1, active RCR; overflows left before an update */
  uint8_t running, updates_enabled, one_pulse;
  uint8_t preload_done; /* the active registers equal the preloaded ones */

  TimChannel channels[TIM_CHANNELS];
  int64_t next_ps;  /* the next time when a flag may be set, if next_known */
  uint8_t next_known;
  uint8_t tick_pending;  /* a tick waits for its handler */
  int64_t tick_ps, missed_ticks;
  TickCounts counts;
} Tim;

/* Callbacks into Python: a handler started wait_ps after its tick; count ticks were lost. */
typedef struct {
  void (*late)(int64_t now_ps, int32_t peripheral, int64_t wait_ps);
  void (*lost)(int64_t now_ps, int32_t peripheral, int64_t count);
} TimCalls;

/* TIM1 to TIM5 and TIM9 to TIM11. */
typedef struct {
  Tim timers[TIMERS];
  TimCalls calls;
} Timers;

void timers_create(Chip *chip);
/* The level of a pin has changed: a channel may capture. */
void timers_pin_changed(Chip *chip, int port, int pin, bool level);

#endif
