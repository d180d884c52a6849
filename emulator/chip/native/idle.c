/* Loops that wait for a variable: HAL_Delay on its tick, while (!flag), while (1).
 *
 * They touch no register, so nothing comes by that could be looked at. Instead a run of instructions without any
 * access is ended after a while, and looked at: is the core in a loop whose iteration is known? Then one
 * iteration is executed. If it leaves all registers and RAM as they were, it will be repeated until the next event,
 * and whole iterations are counted instead of being executed. What is known is found by single steps: from where
 * such a run has ended until the core's state recurs.
 *
 * Decision: ends of runs. The road not taken, a look at every backward branch, costs every loop of the program.
 */
#include <string.h>

#include "bus.h"
#include "chip.h"

#define LOOK 20000        /* instructions after which a run is ended to look */
#define FARTHEST 100000000
#define LONG 2000         /* instructions without an access after which a loop is suspected */
#define LONGEST_LOOP 256  /* instructions of one iteration */
#define PAUSE 1000000     /* instructions between a search in vain and the next; doubled with each */
#define MOST_DOUBLINGS 5
#define MOST_VAIN 100
#define NOWHERE 1u        /* no address of an instruction */

static unsigned place_of(uint32_t address) { return (address >> 1) % IDLE_PLACES; }

void idle_create(Chip *chip) {
  memset(&chip->idle, 0, sizeof chip->idle);
  chip->idle.next_look = LOOK;
  chip->idle.suspect = NOWHERE;
}

static void know_loop(Idle *idle, const uint32_t *addresses, int count, int64_t period) {
  for (int n = 0; n < count; n++) {
    unsigned place = place_of(addresses[n]);
    idle->places[place].address = addresses[n];
    idle->places[place].period = (uint16_t)period;
    idle->places[place].vain = 0;
  }
}

/* Whether the core is as it was, and nothing was accessed since. */
static bool recurs(const Chip *chip, const uint8_t *state, int64_t accesses) {
  return chip->waiting.accesses == accesses && !chip->must_stop && waiting_nothing_changed(chip) &&
         !memcmp(state, chip->core.r, CORE_STATE_SIZE);
}

/* Execute an iteration of a loop that is known, and skip its repetitions. */
static void iterate(Chip *chip, unsigned place) {
  Idle *idle = &chip->idle;
  uint8_t state[CORE_STATE_SIZE];
  int64_t accesses = chip->waiting.accesses, period = idle->places[place].period;
  memcpy(state, chip->core.r, sizeof state);
  waiting_watch(chip);
  bool whole = machine_run(chip, period) == STOP_SLICE && chip->machine.executed == period;
  if (whole && recurs(chip, state, accesses)) {
    int64_t skipped = (chip->machine.end - chip->timeline.count) / period * period;
    chip->timeline.count += skipped;
    chip->waiting.skipped += skipped;
    idle->places[place].vain = 0;
  } else if (++idle->places[place].vain > MOST_VAIN) {
    idle->places[place].period = 0;
  }
}

/* Make steps until the state recurs: then the loop is known. */
static void search(Chip *chip) {
  Idle *idle = &chip->idle;
  uint8_t state[CORE_STATE_SIZE];
  uint32_t path[LONGEST_LOOP + 1], address = chip->core.r[15];
  int64_t accesses = chip->waiting.accesses, begun = timeline_retired(&chip->timeline);
  int length = 0;
  idle->suspect = NOWHERE;
  memcpy(state, chip->core.r, sizeof state);
  waiting_watch(chip);
  path[length++] = address;
  for (int n = 0; n < LONGEST_LOOP && machine_step(chip) && chip->waiting.accesses == accesses; n++) {
    if (chip->core.r[15] == address && recurs(chip, state, accesses)) {
      know_loop(idle, path, length, timeline_retired(&chip->timeline) - begun);
      idle->failures = 0;
      return;
    }
    if (chip->core.r[15] == address) { /* an interrupt may have changed the first state */
      memcpy(state, chip->core.r, sizeof state);
      waiting_watch(chip);
      begun = timeline_retired(&chip->timeline);
      length = 0;
    }
    path[length++] = chip->core.r[15];
  }
  idle->not_before = timeline_retired(&chip->timeline) + ((int64_t)PAUSE << idle->failures);
  idle->failures += idle->failures < MOST_DOUBLINGS;
}

void idle_look(Chip *chip) {
  Idle *idle = &chip->idle;
  bool suspicious = chip->waiting.accesses == idle->accesses && chip->machine.executed >= LONG;
  idle->accesses = chip->waiting.accesses;
  idle->next_look = !suspicious ? LOOK : idle->next_look < FARTHEST ? 2 * idle->next_look : FARTHEST;
  idle->suspect = suspicious ? chip->core.r[15] : NOWHERE;
}

bool idle_execute(Chip *chip, int64_t instructions) {
  Idle *idle = &chip->idle;
  uint32_t address = chip->core.r[15];
  unsigned place = place_of(address);
  int64_t period = idle->places[place].address == address ? idle->places[place].period : 0;
  bool may_search = timeline_retired(&chip->timeline) >= idle->not_before;
  if (period && instructions >= 2 * period) {
    iterate(chip, place);
    return true;
  }
  if (address == idle->suspect && instructions > LONGEST_LOOP && may_search) {
    search(chip);
    return true;
  }
  return false;
}
