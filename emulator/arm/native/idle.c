/* Loops that wait for a variable, when an exception has returned into one; cpu/idle_loops.py finds them.
 *
 * An iteration is executed. If it leaves registers and RAM as they were, all that fit into the run are
 * counted. The first one after an interrupt often differs, because the variable has changed.
 */
#include <string.h>

#include "bus.h"

#define ITERATIONS 3

/* The period is kept for each address of the loop; a hash of the address finds it. */
static uint32_t slot_of(uint32_t address) { return (address >> 1) % IDLE_PLACES; }

void idle_add(Bus *bus, uint32_t address, uint32_t period) {
  uint32_t slot = slot_of(address);
  bus->idle[slot].address = address;
  bus->idle[slot].period = period;
}

/* How many instructions an iteration of the loop at PC has; 0 if none is known or the run ends before two. */
static uint32_t period_here(const Bus *bus) {
  const Core *core = bus->core;
  uint32_t slot = slot_of(core->r[15]), period = bus->idle[slot].period;
  bool known = bus->idle[slot].address == core->r[15] && period && bus->skips;
  return known && core->limit >= core->counter + 2 * (uint64_t)period ? period : 0;
}

/* Execute an iteration. False if more has happened. */
static bool iterate(Bus *bus, uint32_t period, bool *same) {
  Core *core = bus->core;
  uint8_t state[CORE_STATE_SIZE];
  int64_t accesses = bus->accesses;
  uint64_t end = core->counter + period;
  memcpy(state, core->r, sizeof state);
  waiting_watch(bus);
  core->limit = end;
  core_execute(core);
  bool whole = core->stop == STOP_SLICE && core->counter == end && !core->must_stop &&
               bus->accesses == accesses;
  *same = whole && waiting_nothing_changed(bus) && !memcmp(state, core->r, sizeof state);
  waiting_forget(bus);
  return whole;
}

void idle_skip(Bus *bus) {
  bool same = false, whole = true;
  uint32_t period = 0;
  for (int n = 0; n < ITERATIONS && whole && !same && (period = period_here(bus)); n++) {
    whole = iterate(bus, period, &same);
    if (same) {
      int64_t skipped = (bus->end - bus->count - (int64_t)bus->core->counter) / period * period;
      bus->count += skipped;
      bus->skipped += skipped;
    }
    if (whole) {
      bus_set_limit(bus);
    }
  }
}
