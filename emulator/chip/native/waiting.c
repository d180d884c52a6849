/* Waiting loops are skipped: a loop that polls registers and changes nothing repeats itself until one of them does.
 *
 * When a register is read again with the core's registers and RAM as they were at an earlier read of the same run
 * (a passage), and nothing in between had an effect, everything that follows is a repetition, for as long as
 * none of the registers read in it changes: until the earliest of their times, or the end of the run, whole
 * iterations are counted instead of being executed. This is exact; only the speed depends on it. Instead of a copy of
 * all of RAM for each passage there is a log of the words that have changed since the first one.
 *
 * Reads that lead nowhere cost comparisons. A register whose reads were compared in vain for a while is left alone
 * for a while. What is known of a register is kept in a table by a hash of its address; two registers that
 * share a place forget each other's, which costs speed alone.
 */
#include <string.h>

#include "bus.h"
#include "chip.h"

void waiting_forget(Chip *chip) {
  Waiting *waiting = &chip->waiting;
  waiting->comparing = 0;
  waiting->valid_ps = NEVER_PS;
  waiting->logged = 0;
  core_log_stores(&chip->core, false);
}

void waiting_disturb(Chip *chip) {
  chip->waiting.accesses++;
  waiting_outdate(&chip->waiting);
  if (chip->waiting.comparing) {
    waiting_forget(chip);
  }
}

void waiting_log(Chip *chip, uint32_t address, uint32_t old) {
  Waiting *waiting = &chip->waiting;
  if (waiting->logged < WAITING_LOGGED) {
    waiting->log[waiting->logged].address = address;
    waiting->log[waiting->logged].old = old;
  }
  waiting->logged++; /* beyond the log: nothing is known any more */
}

/* Whether RAM is what it was when so much had been logged: the first change of each word tells. */
static bool same_ram(const Chip *chip, uint32_t since) {
  const Waiting *waiting = &chip->waiting;
  if (waiting->logged > WAITING_LOGGED) {
    return false;
  }
  for (uint32_t n = since; n < waiting->logged; n++) {
    uint32_t address = waiting->log[n].address, before = since, now;
    while (waiting->log[before].address != address) {
      before++;
    }
    memcpy(&now, chip->ram + (address - RAM_BASE), 4);
    if (before == n && now != waiting->log[n].old) {
      return false;
    }
  }
  return true;
}

void waiting_watch(Chip *chip) {
  waiting_forget(chip);
  core_log_stores(&chip->core, true);
}

bool waiting_nothing_changed(const Chip *chip) { return same_ram(chip, 0); }

static int32_t *interest_in(Waiting *waiting, uint32_t address) {
  Polled *polled = waiting_place(waiting, address);
  if (polled->address != address) {
    *polled = (Polled){.address = address, .version = -1};
  }
  return &polled->interest;
}

static Passage *find_passage(Chip *chip) {
  Waiting *waiting = &chip->waiting;
  for (int64_t n = waiting->comparing - 1; n >= 0; n--) {
    if (!memcmp(waiting->passages[n].state, chip->core.r, CORE_STATE_SIZE)) {
      return &waiting->passages[n];
    }
  }
  return NULL;
}

/* Go to the last passage before anything happens; where the read is alone in its loop, to the first one at which
 * the register has changed. Gives the instructions skipped, and whether it has. */
static int64_t skip(Chip *chip, int64_t position, int64_t period, bool alone, bool *changed) {
  Timeline *timeline = &chip->timeline;
  int64_t limit = (int64_t)chip->core.limit, valid_ps = chip->waiting.valid_ps, end = chip->machine.end;
  *changed = false;
  if (timeline->count + limit <= position) {
    return 0; /* the run is to end after this instruction */
  }
  int64_t iterations = (end - position) / period;
  if (valid_ps < NEVER_PS) {
    int64_t needed = (timeline_position(timeline, valid_ps) - position) / period + 1;
    *changed = alone && needed <= iterations;
    iterations = *changed ? needed : needed - 1 < iterations ? needed - 1 : iterations;
  }
  if (iterations <= 0) {
    *changed = false;
    return 0;
  }
  int64_t skipped = iterations * period;
  chip->waiting.skipped += skipped;
  timeline->count += skipped;
  if (timeline->count + limit > end) {
    core_limit(&chip->core, (uint64_t)(end - timeline->count));
  }
  return skipped;
}

bool waiting_polled(Chip *chip, uint32_t address, int64_t until_ps) {
  Waiting *waiting = &chip->waiting;
  int64_t accesses = ++waiting->accesses, position = chip->timeline.count + (int64_t)chip->core.counter;
  int32_t *interest = interest_in(waiting, address);
  if (*interest < WAITING_INTERESTING || !waiting->enabled) {
    ++*interest;
    if (waiting->comparing) {
      waiting_forget(chip);
    }
    return false;
  }
  if (chip->now_ps >= waiting->valid_ps || waiting->logged > WAITING_LOGGED) {
    waiting_forget(chip);
  }
  waiting->valid_ps = waiting->valid_ps < until_ps ? waiting->valid_ps : until_ps;
  Passage *passage = find_passage(chip);
  bool repeats = passage && passage->position != position && same_ram(chip, passage->logged);
  int64_t period = passage ? position - passage->position : 0;
  bool alone = passage && accesses - passage->accesses == 1;
  if (!passage) {
    passage = &waiting->passages[waiting->comparing++];
    memcpy(passage->state, chip->core.r, CORE_STATE_SIZE);
    core_log_stores(&chip->core, true);
  }
  passage->position = position;
  passage->accesses = accesses;
  passage->logged = waiting->logged;
  bool changed = false;
  if (repeats) {
    *interest = WAITING_INTERESTING;
    passage->position += skip(chip, position, period, alone, &changed);
    return changed;
  }
  *interest = *interest <= WAITING_INTERESTING + WAITING_VAIN ? *interest + 1 : -WAITING_PAUSE;
  if (waiting->comparing == WAITING_PASSAGES) {
    waiting_forget(chip);
  }
  return false;
}
