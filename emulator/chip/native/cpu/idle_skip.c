/* Skipping of loops that wait for a variable: HAL_Delay on its tick, while (!flag), while (1).
 *
 * Such a loop accesses no register, so no access can trigger a check. Instead, after a while a run of instructions
 * without any access is ended and checked: is the core in a loop whose iteration is known? If so, one iteration is
 * executed. If it leaves all registers and RAM unchanged, it will be repeated until the next event. Whole iterations
 * are then counted instead of executed. New loops are found by single steps, from the end of such a run until the
 * core's state recurs.
 *
 * Decision: idle loops are detected at the end of a run. A check at every backward branch was rejected, because it
 * slows down every loop of the program.
 */
#include <string.h>

#include "bus.h"
#include "chip.h"

#define LOOK 20000        /* instructions after which a run is ended for a check */
#define FARTHEST 100000000
#define LONG 2000         /* instructions without an access after which a loop is suspected */
#define LONGEST_LOOP 256  /* instructions of one iteration */
#define PAUSE 1000000     /* instructions between an unsuccessful search and the next; doubled each time */
#define MOST_DOUBLINGS 5
#define MOST_VAIN 100
#define NOWHERE 1u        /* not an address of an instruction */

static unsigned place_of(uint32_t address) { return (address >> 1) % IDLE_SKIP_SLOTS; }

void idle_skip_create(Chip *chip) {
  memset(&chip->idle_skip, 0, sizeof chip->idle_skip);
  chip->idle_skip.next_look = LOOK;
  chip->idle_skip.suspect = NOWHERE;
}

static void know_loop(IdleSkip *idle_skip, const uint32_t *addresses, int count, int64_t period) {
  for (int n = 0; n < count; n++) {
    unsigned place = place_of(addresses[n]);
    idle_skip->places[place].address = addresses[n];
    idle_skip->places[place].period = (uint16_t)period;
    idle_skip->places[place].vain = 0;
  }
}

/* Return true if the core has its earlier state again, and nothing was accessed since. */
static bool recurs(const Chip *chip, const uint8_t *state, int64_t accesses) {
  return chip->poll_skip.accesses == accesses && !chip->must_stop && poll_skip_nothing_changed(chip) &&
         !memcmp(state, chip->core.r, CORE_STATE_SIZE);
}

/* Execute an iteration of a known loop, and skip its repetitions. */
static void iterate(Chip *chip, unsigned place) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint8_t state[CORE_STATE_SIZE];
  int64_t accesses = chip->poll_skip.accesses, period = idle_skip->places[place].period;
  memcpy(state, chip->core.r, sizeof state);
  poll_skip_watch(chip);
  bool whole = run_loop_run(chip, period) == STOP_SLICE && chip->run_loop.executed == period;
  if (whole && recurs(chip, state, accesses)) {
    int64_t skipped = (chip->run_loop.end - chip->cycle_clock.count) / period * period;
    chip->cycle_clock.count += skipped;
    chip->poll_skip.skipped += skipped;
    idle_skip->places[place].vain = 0;
  } else if (++idle_skip->places[place].vain > MOST_VAIN) {
    idle_skip->places[place].period = 0;
  }
}

/* Step until the state recurs: then the loop is known. */
static void search(Chip *chip) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint8_t state[CORE_STATE_SIZE];
  uint32_t path[LONGEST_LOOP + 1], address = chip->core.r[15];
  int64_t accesses = chip->poll_skip.accesses, begun = cycle_clock_retired(&chip->cycle_clock);
  int length = 0;
  idle_skip->suspect = NOWHERE;
  memcpy(state, chip->core.r, sizeof state);
  poll_skip_watch(chip);
  path[length++] = address;
  for (int n = 0; n < LONGEST_LOOP && run_loop_step(chip) && chip->poll_skip.accesses == accesses; n++) {
    if (chip->core.r[15] == address && recurs(chip, state, accesses)) {
      know_loop(idle_skip, path, length, cycle_clock_retired(&chip->cycle_clock) - begun);
      idle_skip->failures = 0;
      return;
    }
    if (chip->core.r[15] == address) { /* an interrupt may have changed the first state */
      memcpy(state, chip->core.r, sizeof state);
      poll_skip_watch(chip);
      begun = cycle_clock_retired(&chip->cycle_clock);
      length = 0;
    }
    path[length++] = chip->core.r[15];
  }
  idle_skip->not_before = cycle_clock_retired(&chip->cycle_clock) + ((int64_t)PAUSE << idle_skip->failures);
  idle_skip->failures += idle_skip->failures < MOST_DOUBLINGS;
}

void idle_skip_look(Chip *chip) {
  IdleSkip *idle_skip = &chip->idle_skip;
  bool suspicious = chip->poll_skip.accesses == idle_skip->accesses && chip->run_loop.executed >= LONG;
  idle_skip->accesses = chip->poll_skip.accesses;
  idle_skip->next_look = !suspicious ? LOOK : idle_skip->next_look < FARTHEST ? 2 * idle_skip->next_look : FARTHEST;
  idle_skip->suspect = suspicious ? chip->core.r[15] : NOWHERE;
}

bool idle_skip_execute(Chip *chip, int64_t instructions) {
  IdleSkip *idle_skip = &chip->idle_skip;
  uint32_t address = chip->core.r[15];
  unsigned place = place_of(address);
  int64_t period = idle_skip->places[place].address == address ? idle_skip->places[place].period : 0;
  bool may_search = cycle_clock_retired(&chip->cycle_clock) >= idle_skip->not_before;
  if (period && instructions >= 2 * period) {
    iterate(chip, place);
    return true;
  }
  if (address == idle_skip->suspect && instructions > LONGEST_LOOP && may_search) {
    search(chip);
    return true;
  }
  return false;
}
