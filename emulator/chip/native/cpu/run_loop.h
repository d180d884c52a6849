/* The main loop: runs of instructions between events, interrupts, sleep, faults, reset. A run is made of chains of
 * basic blocks (dispatch.h), and of single instructions where more care is needed.
 *
 * Order of things at one point in time: events, then a debugger's halt, then the reset that an event may have
 * asked for, then the entry into an exception, then the next instruction. All of it depends on virtual time
 * alone, so the chip may be run up to any sequence of times: it does the same.
 */
#ifndef FCU_RUN_LOOP_H
#define FCU_RUN_LOOP_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

/* Why fcu_run_until() has returned. */
enum Ended { ENDED_AT_TIME, ENDED_HALTED, ENDED_BY_HOST, ENDED_BY_WORK };
enum Sleep { AWAKE, SLEEPS_WFI, SLEEPS_WFE };
/* Reasons for a reset; the rest are Python's, by number (cpu/core.py). */
enum ResetReason { RESET_NONE, RESET_SYSRESETREQ };

typedef struct {
  int64_t at_ps;   /* until when the chip is to run */
  int64_t end_ps;  /* when the run of instructions under way has to end */
  int64_t end;     /* cycle_clock.count from which on it is end_ps or later */
  int64_t executed; /* instructions of the latest run */
  int32_t reset_reason;
  uint8_t running; /* instructions are being executed */
  uint8_t asleep;  /* enum Sleep */
  uint8_t halting, stepping;
  uint8_t debugged; /* BKPT halts instead of being a fault */
  uint8_t on_bkpt;  /* it has */
  uint8_t reported_lock_up;
} RunLoop;

void run_loop_create(Chip *chip);
/* After something has been scheduled or made pending: end the run of instructions when it matters. */
void run_loop_end_in_time(Chip *chip);
/* HCLK has become another one, now. */
void run_loop_set_rate(Chip *chip);

/* Execute up to so many instructions, and deal with what ended the run: why it ended. For idle_skip.c. */
enum Stop run_loop_run(Chip *chip, int64_t instructions);
/* One instruction; false if something is to be done before the next. */
bool run_loop_step(Chip *chip);

#endif
