/* Skipping of loops that wait for a variable: HAL_Delay(), while (!flag), while (1).
 *
 * These loops access no peripheral register. Therefore a long run without accesses is ended and checked. In a
 * known loop one iteration is executed. If core registers and RAM are unchanged, whole iterations up to the
 * next event are counted instead of executed. New loops are found by executing single instructions.
 *
 * Decision: idle loops are detected at the end of a run. A check at every backward branch would slow down
 * all loops.
 */
#include <string.h>

#include "bus.h"
#include "chip.h"

#define CHECK_INTERVAL 20000 /* maximum number of instructions in a run */
#define CHECK_SOON 500       /* maximum after a skipped loop: firmware may wait again soon */
#define MAX_CHECK_INTERVAL 100000000
#define SUSPECT_AFTER 500 /* instructions without an access, after which a loop is suspected */
#define LONGEST_LOOP 256
#define PAUSE 1000000 /* instructions until the next search; doubled after each unsuccessful search */
#define MAX_DOUBLINGS 5
#define MAX_MISSES 100
#define NO_ADDRESS 1u

static unsigned slot_of(uint32_t address) { return (address >> 1) % IDLE_SKIP_SLOTS; }

void idle_skip_create(Chip *chip) {
  memset(&chip->idle_skip, 0, sizeof chip->idle_skip);
  chip->idle_skip.check_interval = CHECK_INTERVAL;
  chip->idle_skip.suspect = NO_ADDRESS;
}

static void record_loop(IdleSkip *idle_skip, const uint32_t *addresses, int count, int64_t period) {
  for (int n = 0; n < count; n++) {
    unsigned slot = slot_of(addresses[n]);
    idle_skip->loops[slot].address = addresses[n];
    idle_skip->loops[slot].period = (uint16_t)period;
    idle_skip->loops[slot].misses = 0;
  }
}

/* Return true if registers and RAM are as before, and nothing was accessed. */
static bool state_recurs(const Chip *chip, const uint8_t *state, int64_t accesses) {
  return chip->poll_skip.accesses == accesses && !chip->must_stop && poll_skip_ram_unchanged(chip) &&
         !memcmp(state, chip->core.r, CORE_STATE_SIZE);
}

/* Execute an iteration. If this iteration changes nothing, skip its repetitions. */
static void execute_iteration(Chip *chip, unsigned slot) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint8_t state[CORE_STATE_SIZE];
  int64_t accesses = chip->poll_skip.accesses, period = idle_skip->loops[slot].period;
  memcpy(state, chip->core.r, sizeof state);
  poll_skip_begin_log(chip);
  bool whole = run_loop_run(chip, period) == STOP_SLICE && chip->run_loop.executed == period;
  if (whole && state_recurs(chip, state, accesses)) {
    int64_t skipped = (chip->run_loop.slice_end - chip->cycle_clock.count) / period * period;
    chip->cycle_clock.count += skipped;
    chip->poll_skip.skipped += skipped;
    idle_skip->loops[slot].misses = 0;
    idle_skip->check_interval = CHECK_SOON;
  } else if (++idle_skip->loops[slot].misses > MAX_MISSES) {
    idle_skip->loops[slot].period = 0;
  }
}

static void search_loop(Chip *chip) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint8_t state[CORE_STATE_SIZE];
  uint32_t path[LONGEST_LOOP + 1], address = chip->core.r[15];
  int64_t accesses = chip->poll_skip.accesses, begun = cycle_clock_retired(&chip->cycle_clock);
  int length = 0;
  idle_skip->suspect = NO_ADDRESS;
  memcpy(state, chip->core.r, sizeof state);
  poll_skip_begin_log(chip);
  path[length++] = address;
  for (int n = 0; n < LONGEST_LOOP && run_loop_step(chip) && chip->poll_skip.accesses == accesses; n++) {
    if (chip->core.r[15] == address && state_recurs(chip, state, accesses)) {
      record_loop(idle_skip, path, length, cycle_clock_retired(&chip->cycle_clock) - begun);
      idle_skip->failures = 0;
      return;
    }
    if (chip->core.r[15] == address) { /* an interrupt may have changed the state */
      memcpy(state, chip->core.r, sizeof state);
      poll_skip_begin_log(chip);
      begun = cycle_clock_retired(&chip->cycle_clock);
      length = 0;
    }
    path[length++] = chip->core.r[15];
  }
  idle_skip->not_before = cycle_clock_retired(&chip->cycle_clock) + ((int64_t)PAUSE << idle_skip->failures);
  idle_skip->failures += idle_skip->failures < MAX_DOUBLINGS;
}

void idle_skip_check(Chip *chip) {
  IdleSkip *idle_skip = &chip->idle_skip;
  bool suspicious = chip->poll_skip.accesses == idle_skip->accesses && chip->run_loop.executed >= SUSPECT_AFTER;
  idle_skip->accesses = chip->poll_skip.accesses;
  int64_t longest = suspicious ? MAX_CHECK_INTERVAL : CHECK_INTERVAL, interval = idle_skip->check_interval;
  if (chip->run_loop.executed >= interval) {
    interval *= 2;
  }
  idle_skip->check_interval = interval < longest ? interval : longest;
  idle_skip->suspect = suspicious ? chip->core.r[15] : NO_ADDRESS;
}

bool idle_skip_execute(Chip *chip, int64_t instructions) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint32_t address = chip->core.r[15];
  unsigned slot = slot_of(address);
  int64_t period = idle_skip->loops[slot].address == address ? idle_skip->loops[slot].period : 0;
  bool may_search = cycle_clock_retired(&chip->cycle_clock) >= idle_skip->not_before;
  if (period && instructions >= 2 * period) {
    execute_iteration(chip, slot);
    return true;
  }
  if (address == idle_skip->suspect && instructions > LONGEST_LOOP && may_search) {
    search_loop(chip);
    return true;
  }
  return false;
}
