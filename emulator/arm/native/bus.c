/* Accesses to the I2C block's registers at their exact time (cpu/bus.py is the same for all blocks). */
#include <stdlib.h>

#include "bus.h"
#include "i2c.h"

typedef __int128 Wide;

Bus *bus_create(Core *core) {
  Bus *bus = calloc(1, sizeof(Bus));
  Waiting *waiting = waiting_create();
  Nvic *nvic = calloc(1, sizeof(Nvic));
  if (!bus || !waiting || !nvic) {
    free(bus);
    free(nvic);
    free(waiting);
    return NULL;
  }
  bus->core = core;
  bus->waiting = waiting;
  bus->nvic = nvic;
  core->bus = bus;
  return bus;
}

void bus_destroy(Bus *bus) {
  free(bus->waiting);
  free(bus->nvic);
  free(bus);
}

Nvic *bus_nvic(Bus *bus) { return bus->nvic; }

void bus_fire_by(Bus *bus, bool (*fire)(int64_t now_ps)) { bus->fire = fire; }

void bus_attach_i2c(Bus *bus, I2c *i2c, uint32_t base) {
  bus->i2c = i2c;
  bus->i2c_base = base;
}

int64_t bus_now_ps(const Bus *bus) {
  Wide count = bus->count + (int64_t)bus->core->counter - 1;
  return bus->origin_ps + (int64_t)((count * bus->num + bus->extra) / bus->den);
}

int64_t bus_time_after_ps(const Bus *bus, int cycles) {
  Wide count = bus->count + (int64_t)bus->core->counter;
  return bus->origin_ps + (int64_t)((count * bus->num + bus->extra + (Wide)cycles * bus->cycle) / bus->den);
}

void bus_spend(Bus *bus, int cycles) {
  Wide extra = bus->extra + (Wide)cycles * bus->cycle;
  bus->origin_ps += (int64_t)(extra / bus->den);
  bus->extra = (int64_t)(extra % bus->den);
}

int64_t bus_position(const Bus *bus, int64_t at_ps) {
  Wide wanted = (Wide)(at_ps - bus->origin_ps) * bus->den - bus->extra;
  Wide quotient = wanted / bus->num;
  return (int64_t)(quotient + (wanted % bus->num > 0));
}

/* The I2C block, if the access is one that it can answer alone, now. */
static I2c *block_at(const Bus *bus, uint32_t address, unsigned size, int64_t *now_ps) {
  I2c *i2c = bus->i2c;
  if (!i2c || address - bus->i2c_base >= I2C_SIZE || size != 4 || !i2c->alone) {
    return NULL;
  }
  *now_ps = bus_now_ps(bus);
  return *now_ps < bus->end_ps ? i2c : NULL; /* else something is due first */
}

bool bus_read(Bus *bus, uint32_t address, unsigned size, uint32_t *value) {
  int64_t now_ps, until_ps;
  I2c *i2c = block_at(bus, address, size, &now_ps);
  uint32_t offset = address % I2C_SIZE;
  if (!i2c || !i2c_readable(offset)) {
    return false;
  }
  i2c_settle(i2c, now_ps);
  *value = i2c_read(i2c, offset, now_ps, &until_ps);
  if (until_ps < 0) {
    waiting_disturb(bus);
  } else if (waiting_polled(bus, bus->count + (int64_t)bus->core->counter, address, now_ps, until_ps)) {
    now_ps = bus_now_ps(bus);
    i2c_settle(i2c, now_ps);
    *value = i2c_read(i2c, offset, now_ps, &until_ps);
  }
  return true;
}

uint32_t bus_look(Bus *bus, const Window *window, uint32_t address, unsigned size) {
  uint32_t offset = address - window->base;
  int64_t begun = bus->count + (int64_t)bus->core->counter, now_ps = bus_now_ps(bus);
  uint64_t value = window->look(now_ps, offset, size);
  if (bus->until_ps < 0) {
    waiting_disturb(bus);
  } else if (waiting_polled(bus, begun, address, now_ps, bus->until_ps)) {
    value = window->look(bus_now_ps(bus), offset, size);
  }
  return (uint32_t)value;
}

void bus_put(Bus *bus, const Window *window, uint32_t address, unsigned size, uint32_t value) {
  if (!bus->comparing) { /* else Python says whether the write changes anything */
    waiting_disturb(bus);
  }
  window->put(bus_now_ps(bus), address - window->base, size, value);
}

bool bus_write(Bus *bus, uint32_t address, unsigned size, uint32_t value) {
  int64_t now_ps;
  I2c *i2c = block_at(bus, address, size, &now_ps);
  uint32_t offset = address % I2C_SIZE;
  if (!i2c || !i2c_writable(i2c, offset, value)) {
    return false;
  }
  waiting_disturb(bus);
  i2c_settle(i2c, now_ps);
  i2c_write(i2c, offset, value, now_ps);
  return true;
}

void bus_set_limit(Bus *bus) {
  Core *core = bus->core;
  int64_t left = bus_position(bus, bus->end_ps) - bus->count;
  bus->end = bus->count + left;
  uint64_t limit = left < 0 ? 0 : (uint64_t)left;
  limit = limit < core->wanted ? limit : core->wanted;
  core->limit = limit > core->counter ? limit : core->counter;
}

/* Whether the run has come to an event of the clock, which can be carried out here. */
static bool is_due(const Bus *bus) {
  int64_t now_ps = bus_time_after_ps(bus, 0);
  bool may_be_idle = bus->skips && bus->core->counter >= LONG && bus->accesses == bus->looked;
  return bus->fire && now_ps >= bus->end_ps && now_ps < bus->at_ps && !may_be_idle;
}

/* It is carried out, as between runs; false if the run is to end. */
static bool fired(Bus *bus) {
  Core *core = bus->core;
  int64_t now_ps = bus_time_after_ps(bus, 0);
  bus->count += (int64_t)core->counter;
  core->counter = core->limit = 0;
  core->wanted = LOOK;
  bus->looked = bus->accesses;
  core->pc = core->r[15];
  return bus->fire(now_ps);
}

/* Whether the instructions may go on: nothing is to be taken, or it has been. */
static bool taken(Bus *bus) {
  Core *core = bus->core;
  bus->nvic->changed = 0;
  if (!nvic_any_ready(bus->nvic) || exceptions_enter(bus)) {
    return true;
  }
  bool masked = core->primask | core->basepri | core->faultmask; /* unmasking must be noticed */
  return !masked && !exceptions_pending(bus);
}

bool bus_goes_on(Bus *bus) {
  Core *core = bus->core;
  bool changed = bus->nvic->changed;
  if (core->must_stop || !bus->nvic->alone) {
    return false;
  }
  if (core->stop == STOP_EXCEPTION_RETURN) {
    if (!exceptions_leave(bus)) {
      return false;
    }
    core->stop = STOP_SLICE;
  } else if (core->stop != STOP_SLICE || !(is_due(bus) ? fired(bus) : changed)) {
    return false;
  }
  waiting_forget(bus);
  if (core->must_stop || !taken(bus)) {
    core->limit = core->counter;
    return false;
  }
  bus_set_limit(bus);
  if (core->counter < core->limit && !in_handler(core)) {
    idle_skip(bus);
  }
  return core->stop == STOP_SLICE && !core->must_stop && (core->counter < core->limit || is_due(bus));
}

bool bus_take_exception(Bus *bus) {
  bus->core->counter = 0;
  bus->core->r[15] = bus->core->pc;
  return exceptions_enter(bus);
}
