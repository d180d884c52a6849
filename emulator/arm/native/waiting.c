/* Waiting is skipped: cpu/waiting.py, whose docstring says why this is exact, with one difference. Instead of
 * a copy of all of RAM for each passage there is a log of the words that have changed since the first one. */
#include <stdlib.h>
#include <string.h>

#include "bus.h"

#define INTERESTING 3 /* reads of a register after which it is worth comparing states */
#define TIRED 50      /* passages in vain, one after another, after which it is not */
#define REST 2000     /* reads without comparing then */
#define KEPT 64       /* passages */
#define LOGGED 128    /* changes of RAM */
#define POLLED_BITS 6
#define POLLED (1u << POLLED_BITS) /* registers */

typedef struct {
  uint8_t state[CORE_STATE_SIZE];
  int64_t position, accesses;
  uint32_t logged;
} Passage;

struct Waiting {
  Passage passages[KEPT];
  int64_t valid_ps;
  uint32_t logged;
  struct {
    uint32_t address, old;
  } log[LOGGED];
  struct {
    uint32_t address;
    int32_t interest;
  } polled[POLLED];
};

Waiting *waiting_create(void) { return calloc(1, sizeof(Waiting)); }

void waiting_forget(Bus *bus) {
  bus->comparing = 0;
  bus->waiting->valid_ps = NEVER_PS;
  bus->waiting->logged = 0;
  core_log_stores(bus->core, false);
}

void waiting_disturb(Bus *bus) {
  bus->accesses++;
  if (bus->comparing) {
    waiting_forget(bus);
  }
}

void waiting_log(Waiting *waiting, uint32_t address, uint32_t old) {
  if (waiting->logged < LOGGED) {
    waiting->log[waiting->logged].address = address;
    waiting->log[waiting->logged].old = old;
  }
  waiting->logged++; /* beyond the log: nothing is known any more */
}

/* Whether RAM is what it was when so much had been logged: the first change of each word tells. */
static bool same_ram(const Bus *bus, uint32_t since) {
  const Waiting *waiting = bus->waiting;
  if (waiting->logged > LOGGED) {
    return false;
  }
  for (uint32_t n = since; n < waiting->logged; n++) {
    uint32_t address = waiting->log[n].address, before = since, now;
    while (waiting->log[before].address != address) {
      before++;
    }
    memcpy(&now, bus->core->ram + (address - RAM_BASE), 4);
    if (before == n && now != waiting->log[n].old) {
      return false;
    }
  }
  return true;
}

void waiting_watch(Bus *bus) {
  waiting_forget(bus);
  core_log_stores(bus->core, true);
}

bool waiting_nothing_changed(const Bus *bus) { return same_ram(bus, 0); }

/* Where a register's interest is kept; NULL if too many registers are polled. Registers of different blocks
 * have the same low bits: the multiplication spreads them (Knuth, The Art of Computer Programming, 6.4). */
static int32_t *interest_in(Waiting *waiting, uint32_t address) {
  uint32_t first = address * 0x9E3779B1u >> (32 - POLLED_BITS);
  for (uint32_t n = 0; n < POLLED; n++) {
    uint32_t slot = (first + n) % POLLED;
    if (!waiting->polled[slot].address) {
      waiting->polled[slot].address = address;
    }
    if (waiting->polled[slot].address == address) {
      return &waiting->polled[slot].interest;
    }
  }
  return NULL;
}

static Passage *find_passage(const Bus *bus) {
  const Core *core = bus->core;
  for (int64_t n = bus->comparing - 1; n >= 0; n--) {
    Passage *passage = &bus->waiting->passages[n];
    if (!memcmp(passage->state, core->r, CORE_STATE_SIZE)) {
      return passage;
    }
  }
  return NULL;
}

/* Go to the last passage before anything happens; where the read is alone in its loop, to the first one at
 * which the register has changed. Gives the instructions skipped, and whether it has. */
static int64_t skip(Bus *bus, int64_t position, int64_t period, bool alone, bool *changed) {
  int64_t limit = (int64_t)bus->core->limit, valid_ps = bus->waiting->valid_ps;
  *changed = false;
  if (bus->count + limit <= position) {
    return 0; /* the run is to end behind this instruction */
  }
  int64_t iterations = (bus->end - position) / period;
  if (valid_ps < NEVER_PS) {
    int64_t needed = (bus_position(bus, valid_ps) - position) / period + 1;
    *changed = alone && needed <= iterations;
    iterations = *changed ? needed : needed - 1 < iterations ? needed - 1 : iterations;
  }
  if (iterations <= 0) {
    *changed = false;
    return 0;
  }
  int64_t skipped = iterations * period;
  bus->skipped += skipped;
  bus->count += skipped;
  if (bus->count + limit > bus->end) {
    bus->core->limit = (uint64_t)(bus->end - bus->count);
  }
  return skipped;
}

bool waiting_polled(Bus *bus, int64_t position, uint32_t address, int64_t now_ps, int64_t until_ps) {
  Waiting *waiting = bus->waiting;
  int64_t accesses = ++bus->accesses;
  int32_t *interest = interest_in(waiting, address);
  if (!interest || *interest < INTERESTING || !bus->skips) {
    if (interest) {
      ++*interest;
    }
    if (bus->comparing) {
      waiting_forget(bus);
    }
    return false;
  }
  if (now_ps >= waiting->valid_ps || waiting->logged > LOGGED) {
    waiting_forget(bus);
  }
  waiting->valid_ps = waiting->valid_ps < until_ps ? waiting->valid_ps : until_ps;
  Passage *passage = find_passage(bus);
  bool repeats = passage && passage->position != position && same_ram(bus, passage->logged);
  int64_t period = passage ? position - passage->position : 0;
  bool alone = passage && accesses - passage->accesses == 1;
  if (!passage) {
    passage = &waiting->passages[bus->comparing++];
    memcpy(passage->state, bus->core->r, CORE_STATE_SIZE);
    core_log_stores(bus->core, true);
  }
  passage->position = position;
  passage->accesses = accesses;
  passage->logged = waiting->logged;
  bool changed = false;
  if (repeats) {
    *interest = INTERESTING;
    passage->position += skip(bus, position, period, alone, &changed);
    return changed;
  }
  *interest = *interest <= INTERESTING + TIRED ? *interest + 1 : -REST;
  if (bus->comparing == KEPT) {
    waiting_forget(bus);
  }
  return false;
}
