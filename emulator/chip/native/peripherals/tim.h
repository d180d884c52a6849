/* Timers TIM1 to TIM5 and TIM9 to TIM11. */
#ifndef FCU_TIM_H
#define FCU_TIM_H

#include "peripherals/peripheral.h"
#include "cpu/division.h"

#define TIMERS 8
#define TIM_CHANNELS 4

/* Update interrupts, for the run's summary. */
typedef struct {
  int64_t ticks; /* updates while UIE was set */
  int64_t late;
  int64_t lost;
  int64_t longest_wait_ps; /* longest time from a late tick until its flag is cleared */
} TickCounts;

typedef struct {
  uint8_t settings; /* the channel's byte of CCMR */
  uint8_t enable;   /* CCER: E, P, NE, NP */
  uint8_t edges;    /* edges since the latest capture */
  uint8_t match_count;
  uint32_t compare;
  int64_t matches[2]; /* positions that raise the flag */
} TimChannel;

/* Signals that start conversions of the ADC: outputs of the channels, and the trigger output. */
enum TimSignal { TIM_CC1, TIM_CC2, TIM_CC3, TIM_CC4, TIM_TRGO };

enum TimMode { TIM_UP, TIM_DOWN, TIM_CENTRE };

typedef struct {
  Peripheral peripheral;
  const struct TimVariant *variant;
  int32_t event;
  int32_t edge_event; /* TIM5: event of an oscillator's edge at input 4, or -1 */
  uint32_t registers[21]; /* by offset / 4, without CNT */

  enum TimMode mode;
  int64_t index, arr;      /* arr: active ARR */
  int64_t overflow_period; /* counts between overflows */
  int64_t cycle_length;

  /* Tick k is at origin_ps + (k * num + extra) / den, rounded down only at the end. */
  int64_t hz, num, den, extra;
  Divisor by_num;
  int64_t max_ps, max_ticks; /* below these limits, products need only 64 bits */
  int64_t origin_ps;
  /* tick of the latest count; while the counter is stopped: the negative number of ticks since that count */
  int64_t base_tick;
  uint32_t prescale, repetition, repetitions_left; /* active values of PSC + 1 and RCR */
  uint8_t running, updates_enabled, one_pulse;
  uint8_t preload_done; /* active registers equal preloaded registers */

  TimChannel channels[TIM_CHANNELS];
  uint8_t listened; /* bit = enum TimSignal: signals whose edges another peripheral uses */
  uint8_t signals;  /* latest levels of the signals */
  uint8_t pulses;   /* bit = code of CR2.MMS: pulses of the trigger output that are not reported yet */
  uint8_t followed; /* bit = channel: matches change the level of its output (OCxM 1 to 3) */
  uint8_t latched;  /* bit = channel: level of an output that does not depend on the counter (OCxM 0 to 3) */
  int64_t next_ps; /* next flag or edge with a listener, if next_known */
  uint8_t next_known;
  uint8_t tick_pending; /* a tick waits for its handler */
  int64_t tick_ps, missed_ticks;
  TickCounts counts;
} Tim;

typedef struct {
  void (*late)(int64_t now_ps, int32_t peripheral, int64_t wait_ps);
  void (*lost)(int64_t now_ps, int32_t peripheral, int64_t count);
} TimCalls;

typedef struct {
  Tim timers[TIMERS];
  TimCalls calls;
} Timers;

void timers_create(Chip *chip);
void timers_oscillators_changed(Chip *chip); /* Handle a change of LSI or LSE. */
/* Report the edges of a signal of TIM1 to TIM5 to adc_timer_signal(). */
void timers_listen(Chip *chip, int number, enum TimSignal signal);
void timers_ignore_all(Chip *chip);
void timers_pin_changed(Chip *chip, int port, int pin, bool level);

#endif
