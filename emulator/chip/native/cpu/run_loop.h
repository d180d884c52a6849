/* The main loop: runs of instructions between events, interrupts, sleep, faults and reset. A run consists
 * of chains of basic blocks (dispatch.h), or of single instructions.
 *
 * The order of simultaneous work is: events, debugger's halt, reset, exception entry, instruction. This order
 * depends on virtual time only, not on the times at which runs end.
 */
#ifndef FCU_RUN_LOOP_H
#define FCU_RUN_LOOP_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

enum Ended { ENDED_AT_TIME, ENDED_HALTED, ENDED_BY_HOST, ENDED_BY_WORK };
enum Sleep { AWAKE, SLEEPS_WFI, SLEEPS_WFE };
/* Results of host.deep_sleep(): no sleep, sleep with clocks, Standby. */
enum DeepSleep { DEEP_REFUSED = -1, DEEP_WITH_CLOCKS = -2, DEEP_STANDBY = -3 };
/* LIGHT: no deep sleep, or Python was not asked yet. CLOCKED: deep sleep with clocks. WAKING: Stop ends at wakes_ps. */
enum Depth { LIGHT, CLOCKED, STOPPED, WAKING, STANDBY };
/* Python has more reset reasons (_REASONS in emulator/chip/cpu/core.py). */
enum ResetReason { RESET_NONE, RESET_SYSRESETREQ, RESET_STANDBY = 6 };

typedef struct {
  int64_t until_ps;
  int64_t slice_end_ps; /* end of the current run */
  int64_t slice_end;    /* value of cycle_clock.count at which the current run ends */
  int64_t executed;
  int32_t reset_reason;
  uint8_t running;
  uint8_t asleep;
  uint8_t depth;
  int64_t wake_up_ps; /* time that the chip needs to wake from Stop */
  int64_t wakes_ps;
  uint8_t halt_requested, stepping;
  uint8_t debug_enabled; /* BKPT halts the core */
  uint8_t halted_on_bkpt;
  uint8_t reported_lock_up;
} RunLoop;

void run_loop_create(Chip *chip);
/* End the run in time for an event that was scheduled or an exception that became pending. */
void run_loop_update_limit(Chip *chip);
void run_loop_hclk_changed(Chip *chip);

/* Execute one run and handle its end; for idle_skip.c. */
enum Stop run_loop_run(Chip *chip, int64_t instructions);
/* Execute one instruction. Return false if other work is due. */
bool run_loop_step(Chip *chip);

#endif
