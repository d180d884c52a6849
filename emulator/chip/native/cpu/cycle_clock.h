/* Virtual time = origin + retired instructions x cycles per instruction / HCLK, exactly.
 *
 * Decision: every instruction takes the same number of cycles, 1.3 by default. Most instructions take one
 * cycle. A load takes two cycles, unless the next instruction hides one cycle. A taken branch takes two to
 * four cycles (Cortex-M4 TRM, table 3-1). The flash accelerator hides the wait states except in long jumps
 * (RM0368 3.4.2). If every fifth instruction is a load, half of the loads have a hidden cycle, and every
 * tenth instruction is a taken branch, this gives 1 + 0.1 + 0.2 cycles. The 1.25 DMIPS/MHz of Dhrystone agree
 * with this result. A model of the pipeline was rejected, because it triples the work and the accelerator's
 * cache is not documented.
 */
#ifndef FCU_CYCLE_CLOCK_H
#define FCU_CYCLE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "cpu/division.h"

/* Time after n more instructions: origin_ps + ((count + n) * num + extra) / den, rounded down only at the
 * end. */
typedef struct {
  int64_t count; /* instructions since the origin, without those of the current run */
  int64_t origin_ps;
  int64_t num, den, extra;
  int64_t extra_per_cycle;
  int64_t retired_before; /* number of instructions before the origin */
  int64_t cycles_num, cycles_den;
  int64_t limit; /* lower counts need only 64 bits */
  Divisor by_den;
} CycleClock;

void cycle_clock_create(CycleClock *cycle_clock, int64_t cycles_num, int64_t cycles_den, int64_t hclk_hz);
int64_t cycle_clock_wide_ps(const CycleClock *cycle_clock, int64_t count);
/* Return the first count whose time is at_ps or later. */
int64_t cycle_clock_count_at(const CycleClock *cycle_clock, int64_t at_ps);
/* Move the origin to the present time before products exceed 64 bits. Times do not change. Call this
 * between runs. If an oscillator has an error, num and den are large, and the limit is reached within a
 * tenth of a second. */
void cycle_clock_move_origin(CycleClock *cycle_clock);
/* Add the cycles of exception entry and return. Call this between runs. */
void cycle_clock_add_cycles(CycleClock *cycle_clock, int cycles);
void cycle_clock_sleep_until(CycleClock *cycle_clock, int64_t at_ps);
/* Set HCLK from the time at_ps on. running: instructions that the current run has executed. */
void cycle_clock_set_rate(CycleClock *cycle_clock, int64_t hclk_hz, int64_t at_ps, int64_t running);

/* Return the time after n more instructions. n = -1 gives the start of the current instruction. */
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
