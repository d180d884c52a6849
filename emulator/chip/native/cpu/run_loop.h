/* The main loop: runs of instructions between events, interrupts, sleep, faults and reset. A run consists of chains
 * of basic blocks (dispatch.h), and of single instructions if more care is needed.
 *
 * Order at one point in time: events, then a debugger's halt, then a reset that an event requested, then exception
 * entry, then the next instruction. The order depends on virtual time only. The chip therefore behaves the same for
 * any sequence of end times.
 */
#ifndef FCU_RUN_LOOP_H
#define FCU_RUN_LOOP_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

/* The reason why fcu_run_until() returned. */
enum Ended { ENDED_AT_TIME, ENDED_HALTED, ENDED_BY_HOST, ENDED_BY_WORK };
enum Sleep { AWAKE, SLEEPS_WFI, SLEEPS_WFE };
/* Reasons for a reset; the other numbers are Python's (cpu/core.py). */
enum ResetReason { RESET_NONE, RESET_SYSRESETREQ };

typedef struct {
  int64_t until_ps; /* the time at which the chip's run ends */
  int64_t slice_end_ps; /* the time at which the current run of instructions must end */
  int64_t slice_end;   /* the first value of cycle_clock.count at end_ps or later */
  int64_t executed; /* instructions of the latest run */
  int32_t reset_reason;
  uint8_t running; /* instructions are being executed */
  uint8_t asleep;  /* enum Sleep */
  uint8_t halt_requested, stepping;
  uint8_t debug_enabled; /* BKPT halts instead of causing a fault */
  uint8_t halted_on_bkpt; /* BKPT has halted the core */
  uint8_t reported_lock_up;
} RunLoop;

void run_loop_create(Chip *chip);
/* Call this after an event was scheduled or an exception made pending: end the run of instructions in time. */
void run_loop_update_limit(Chip *chip);
/* Apply a change of HCLK at the current time. */
void run_loop_hclk_changed(Chip *chip);

/* Execute at most `instructions`, handle the end of the run and return its reason. For idle_skip.c. */
enum Stop run_loop_run(Chip *chip, int64_t instructions);
/* Execute one instruction; false if other work is due before the next. */
bool run_loop_step(Chip *chip);

#endif
