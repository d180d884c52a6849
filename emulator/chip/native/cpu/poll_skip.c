/* Skipping of poll loops.
 *
 * Each read of a polled register records the core's state. If the core's registers and RAM equal an earlier
 * state of this run, and nothing in between had an effect, the loop repeats. The repetition ends when one of
 * the polled registers may change. Whole iterations before that time are counted, not executed; the result is
 * exact. A log of changed words makes copies of RAM unnecessary. After a number of unsuccessful comparisons
 * at a register, comparisons pause for this register.
 */
#include <string.h>

#include "bus.h"
#include "chip.h"

void poll_skip_reset(Chip *chip) {
  PollSkip *poll_skip = &chip->poll_skip;
  poll_skip->state_count = 0;
  poll_skip->valid_ps = NEVER_PS;
  poll_skip->logged = 0;
  core_log_stores(&chip->core, false);
}

void poll_skip_side_effect(Chip *chip) {
  chip->poll_skip.accesses++;
  poll_skip_invalidate(&chip->poll_skip);
  if (chip->poll_skip.state_count) {
    poll_skip_reset(chip);
  }
}

void poll_skip_log_store(Chip *chip, uint32_t address, uint32_t old) {
  PollSkip *poll_skip = &chip->poll_skip;
  if (poll_skip->logged < POLL_SKIP_LOGGED) {
    poll_skip->log[poll_skip->logged].address = address;
    poll_skip->log[poll_skip->logged].old = old;
  }
  /* if this exceeds POLL_SKIP_LOGGED, the log is incomplete, and states cannot be compared */
  poll_skip->logged++;
}

/* RAM is unchanged if each logged word has the value of its first entry in the log again. */
static bool ram_unchanged_since(const Chip *chip, uint32_t since) {
  const PollSkip *poll_skip = &chip->poll_skip;
  if (poll_skip->logged > POLL_SKIP_LOGGED) {
    return false;
  }
  for (uint32_t n = since; n < poll_skip->logged; n++) {
    uint32_t address = poll_skip->log[n].address, before = since, now;
    while (poll_skip->log[before].address != address) {
      before++;
    }
    memcpy(&now, chip->ram + (address - RAM_BASE), 4);
    if (before == n && now != poll_skip->log[n].old) {
      return false;
    }
  }
  return true;
}

void poll_skip_begin_log(Chip *chip) {
  poll_skip_reset(chip);
  core_log_stores(&chip->core, true);
}

bool poll_skip_ram_unchanged(const Chip *chip) { return ram_unchanged_since(chip, 0); }

static int32_t *poll_count_of(PollSkip *poll_skip, uint32_t address) {
  Polled *polled = poll_skip_slot(poll_skip, address);
  if (polled->address != address) {
    *polled = (Polled){.address = address, .version = -1};
  }
  return &polled->poll_count;
}

static PollState *find_state(Chip *chip) {
  PollSkip *poll_skip = &chip->poll_skip;
  for (int64_t n = poll_skip->state_count - 1; n >= 0; n--) {
    if (!memcmp(poll_skip->states[n].core, chip->core.r, CORE_STATE_SIZE)) {
      return &poll_skip->states[n];
    }
  }
  return NULL;
}

/* Skip to the final read before the register changes. If the loop contains no other read, skip beyond the
 * change. */
static int64_t skip(Chip *chip, int64_t position, int64_t period, bool alone, bool *changed) {
  CycleClock *cycle_clock = &chip->cycle_clock;
  int64_t limit = (int64_t)chip->core.limit, valid_ps = chip->poll_skip.valid_ps, end = chip->run_loop.slice_end;
  *changed = false;
  if (cycle_clock->count + limit <= position) {
    return 0;
  }
  int64_t iterations = (end - position) / period;
  if (valid_ps < NEVER_PS) {
    int64_t needed = (cycle_clock_count_at(cycle_clock, valid_ps) - position) / period + 1;
    *changed = alone && needed <= iterations;
    iterations = *changed ? needed : needed - 1 < iterations ? needed - 1 : iterations;
  }
  if (iterations <= 0) {
    *changed = false;
    return 0;
  }
  int64_t skipped = iterations * period;
  chip->poll_skip.skipped += skipped;
  cycle_clock->count += skipped;
  if (cycle_clock->count + limit > end) {
    core_set_limit(&chip->core, (uint64_t)(end - cycle_clock->count));
  }
  return skipped;
}

bool poll_skip_register_read(Chip *chip, uint32_t address, int64_t until_ps) {
  PollSkip *poll_skip = &chip->poll_skip;
  int64_t accesses = ++poll_skip->accesses, position = chip->cycle_clock.count + (int64_t)chip->core.counter;
  int32_t *poll_count = poll_count_of(poll_skip, address);
  if (*poll_count < POLL_SKIP_COMPARE_AFTER || !poll_skip->enabled) {
    ++*poll_count;
    if (poll_skip->state_count) {
      poll_skip_reset(chip);
    }
    return false;
  }
  if (chip->now_ps >= poll_skip->valid_ps || poll_skip->logged > POLL_SKIP_LOGGED) {
    poll_skip_reset(chip);
  }
  poll_skip->valid_ps = poll_skip->valid_ps < until_ps ? poll_skip->valid_ps : until_ps;
  PollState *state = find_state(chip);
  bool repeats = state && state->position != position && ram_unchanged_since(chip, state->logged);
  int64_t period = state ? position - state->position : 0;
  bool alone = state && accesses - state->accesses == 1;
  if (!state) {
    state = &poll_skip->states[poll_skip->state_count++];
    memcpy(state->core, chip->core.r, CORE_STATE_SIZE);
    core_log_stores(&chip->core, true);
  }
  state->position = position;
  state->accesses = accesses;
  state->logged = poll_skip->logged;
  bool changed = false;
  if (repeats) {
    *poll_count = POLL_SKIP_COMPARE_AFTER;
    state->position += skip(chip, position, period, alone, &changed);
    return changed;
  }
  *poll_count = *poll_count <= POLL_SKIP_COMPARE_AFTER + POLL_SKIP_MAX_MISSES ? *poll_count + 1 : -POLL_SKIP_PAUSE;
  if (poll_skip->state_count == POLL_SKIP_STATES) {
    poll_skip_reset(chip);
  }
  return false;
}
