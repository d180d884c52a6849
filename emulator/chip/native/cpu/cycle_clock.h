/* Virtual time from retired instructions: time = origin + instructions x cycles per instruction / HCLK, exactly.
 *
 * Decision: every instruction takes the same number of cycles, 1.3 by default. The Cortex-M4 executes most
 * instructions in one cycle. A load takes two unless the next one hides it, a taken branch two to four (Cortex-M4
 * technical reference manual, table 3-1). ST's flash accelerator (ART) hides the two wait states at 84 MHz except in
 * long jumps (RM0368 section 3.4.2). With a load in every fifth instruction, half of them hidden, and a taken branch
 * in every tenth, compiled code needs 1 + 0.1 + 0.2 cycles. Dhrystone's published 1.25 DMIPS/MHz, some 450 cycles
 * per iteration of about 340 instructions, agrees. A model of the pipeline was rejected: it costs three times the
 * work per instruction, and the ART's undocumented cache would limit its accuracy.
 */
#ifndef FCU_CYCLE_CLOCK_H
#define FCU_CYCLE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "cpu/division.h"

/* The time after n more instructions is origin_ps + ((count + n) * num + extra) / den, rounded down once. */
typedef struct {
  int64_t count;     /* instructions retired since the origin, without those of the current run */
  int64_t origin_ps;
  int64_t num, den, extra; /* extra is smaller than den */
  int64_t extra_per_cycle;   /* the increase of extra per cycle */
  int64_t retired_before;   /* instructions retired before the origin */
  int64_t cycles_num, cycles_den; /* cycles per instruction */
  int64_t limit;     /* counts below this can be multiplied in 64 bits */
  Divisor by_den;
} CycleClock;

void cycle_clock_create(CycleClock *cycle_clock, int64_t cycles_num, int64_t cycles_den, int64_t hclk_hz);
/* cycle_clock_ps() for counts that need more than 64 bits. */
int64_t cycle_clock_wide_ps(const CycleClock *cycle_clock, int64_t count);
/* Return the first value of count at at_ps or later. */
int64_t cycle_clock_count_at(const CycleClock *cycle_clock, int64_t at_ps);
/* Move the origin to the present before counts exceed 64 bits; times do not change. Between runs. A clock with a
 * deviation has a rate without small terms: its limit is a tenth of a second.
 */
void cycle_clock_move_origin(CycleClock *cycle_clock);
/* Spend cycles in which no instruction retires: exception entry and return. Between runs. */
void cycle_clock_add_cycles(CycleClock *cycle_clock, int cycles);
/* Stop the core until at_ps. */
void cycle_clock_sleep_until(CycleClock *cycle_clock, int64_t at_ps);
/* Change HCLK at at_ps, `running` instructions after the start of the current run. */
void cycle_clock_set_rate(CycleClock *cycle_clock, int64_t hclk_hz, int64_t at_ps, int64_t running);

/* Return the time after n more instructions; n = -1 is the start of the current instruction. */
static inline int64_t cycle_clock_ps(const CycleClock *cycle_clock, int64_t n) {
  int64_t count = cycle_clock->count + n;
  if (count >= 0 && count < cycle_clock->limit) {
    return cycle_clock->origin_ps + fast_divide(count * cycle_clock->num + cycle_clock->extra, &cycle_clock->by_den);
  }
  return cycle_clock_wide_ps(cycle_clock, count);
}

static inline int64_t cycle_clock_retired(const CycleClock *cycle_clock) {
    return cycle_clock->retired_before + cycle_clock->count; }

#endif
