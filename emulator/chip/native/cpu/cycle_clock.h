/* Virtual time from retired instructions: time = origin + instructions x cycles per instruction / HCLK, exactly.
 *
 * Decision: one number of cycles for every instruction, 1.3 unless set otherwise. The Cortex-M4 executes most
 * instructions in one cycle; a load takes two unless the next one hides it, a taken branch two to four
 * (Cortex-M4 technical reference manual, table 3-1), and ST's flash accelerator (ART) makes up for the two wait
 * states at 84 MHz in all but long jumps (RM0368 section 3.4.2). With a load in every fifth instruction, half
 * of them hidden, and a taken branch in every tenth, compiled code comes to 1 + 0.1 + 0.2. Dhrystone's
 * published 1.25 DMIPS/MHz, some 450 cycles an iteration of about 340 instructions, says the same. The road not
 * taken is a model of the pipeline: three times the work at every instruction, for an accuracy that the ART's
 * undocumented cache would undo.
 */
#ifndef FCU_CYCLE_CLOCK_H
#define FCU_CYCLE_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#include "cpu/division.h"

/* The time after n more instructions is origin_ps + ((count + n) * num + extra) / den, rounded down once. */
typedef struct {
  int64_t count;     /* instructions retired since the origin; those of the run under way not included */
  int64_t origin_ps;
  int64_t num, den, extra; /* extra is smaller than den */
  int64_t cycle;     /* what one cycle adds to extra */
  int64_t before;    /* instructions retired before the origin */
  int64_t cycles_num, cycles_den; /* cycles of an instruction */
  int64_t limit;     /* counts below it can be multiplied in 64 bits */
  Divisor by_den;
} CycleClock;

void cycle_clock_create(CycleClock *cycle_clock, int64_t cycles_num, int64_t cycles_den, int64_t hclk_hz);
/* The same as cycle_clock_ps() for counts that need more than 64 bits. */
int64_t cycle_clock_wide_ps(const CycleClock *cycle_clock, int64_t count);
/* The value of count from which on the time is at_ps or later. */
int64_t cycle_clock_position(const CycleClock *cycle_clock, int64_t at_ps);
/* Move the origin to the present before counts exceed 64 bits; no time changes. Between runs. A clock with a deviation
 * has a rate without small terms: its limit is a tenth of a second.
 */
void cycle_clock_move_origin(CycleClock *cycle_clock);
/* Cycles in which no instruction is retired: exception entry and return. Between runs. */
void cycle_clock_spend(CycleClock *cycle_clock, int cycles);
/* The core stands still until at_ps. */
void cycle_clock_sleep_until(CycleClock *cycle_clock, int64_t at_ps);
/* HCLK changes at at_ps, `running` instructions into the present run. */
void cycle_clock_set_rate(CycleClock *cycle_clock, int64_t hclk_hz, int64_t at_ps, int64_t running);

/* The time after n more instructions; n may be -1: the one in flight has begun then. */
static inline int64_t cycle_clock_ps(const CycleClock *cycle_clock, int64_t n) {
  int64_t count = cycle_clock->count + n;
  if (count >= 0 && count < cycle_clock->limit) {
    return cycle_clock->origin_ps + divided(count * cycle_clock->num + cycle_clock->extra, &cycle_clock->by_den);
  }
  return cycle_clock_wide_ps(cycle_clock, count);
}

static inline int64_t cycle_clock_retired(const CycleClock *cycle_clock) {
    return cycle_clock->before + cycle_clock->count; }

#endif
