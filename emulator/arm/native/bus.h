/* Registers that are reached without Python: time, waiting, and the I2C block. */
#ifndef FCU_BUS_H
#define FCU_BUS_H

#include "core.h"
#include "nvic.h"

#define NEVER_PS ((int64_t)1 << 62) /* as in emulator/clock.py */

#define I2C_SIZE 0x400u
#define IDLE_PLACES 256
/* When cpu/idle_loops.py looks for a loop: so many instructions after an event, or at one, after so many
 * without an access. */
#define LOOK 20000
#define LONG 2000

typedef struct I2c I2c;
typedef struct Waiting Waiting;

/* What native_bus.py sees comes first, in this order: cpu/timeline.py, cpu/slice.py, cpu/waiting.py. */
typedef struct Bus {
  int64_t count, origin_ps, num, den, extra; /* Timeline; extra is smaller than den */
  int64_t cycle;                             /* likewise: what a cycle adds to extra */
  int64_t end, end_ps, at_ps, until_ps;      /* Slice */
  int64_t accesses, skipped, comparing;      /* Waiting; the last one: how many passages are kept */
  int64_t skips;                             /* whether waiting is skipped at all */
  Core *core;
  Nvic *nvic;
  int64_t looked;               /* accesses when the instructions after the latest event began */
  bool (*fire)(int64_t now_ps); /* carries out what the clock has for now; false: the run is to end */
  I2c *i2c; /* NULL, or the block at i2c_base */
  uint32_t i2c_base;
  Waiting *waiting;
  struct {
    uint32_t address, period;
  } idle[IDLE_PLACES];
} Bus;

Bus *bus_create(Core *core);
void bus_destroy(Bus *bus);
/* The time of the access in flight. */
int64_t bus_now_ps(const Bus *bus);
/* The time behind the instructions executed so far, and so many cycles more. */
int64_t bus_time_after_ps(const Bus *bus, int cycles);
/* Cycles in which no instruction is executed. */
void bus_spend(Bus *bus, int cycles);
/* The value of count from which on the time is at_ps or later. */
int64_t bus_position(const Bus *bus, int64_t at_ps);

/* Accesses that need nobody else; false, and nothing has happened, for all others. */
bool bus_read(Bus *bus, uint32_t address, unsigned size, uint32_t *value);
bool bus_write(Bus *bus, uint32_t address, unsigned size, uint32_t value);

/* The run may be longer or shorter than it was meant to be, because time has been spent. */
void bus_set_limit(Bus *bus);
/* A run has ended: whether it goes on, because what it met has been dealt with. */
bool bus_goes_on(Bus *bus);

/* Everything else of a window whose callback wants the time. */
uint32_t bus_look(Bus *bus, const Window *window, uint32_t address, unsigned size);
void bus_put(Bus *bus, const Window *window, uint32_t address, unsigned size, uint32_t value);

/* -- exceptions.c: false, and nothing has changed, where somebody else has to --------------------------- */

/* Enter the most urgent exception, if one may preempt; between instructions. */
bool exceptions_enter(Bus *bus);
/* Whether one may preempt. */
bool exceptions_pending(const Bus *bus);
/* The same between runs. */
bool bus_take_exception(Bus *bus);
/* PC has been loaded with an EXC_RETURN value. */
bool exceptions_leave(Bus *bus);

/* -- idle.c --------------------------------------------------------------------------------------------- */

/* If PC is in a loop that is known, and that only repeats itself: go to the end of the run. */
void idle_skip(Bus *bus);
void idle_add(Bus *bus, uint32_t address, uint32_t period);

/* -- waiting.c ------------------------------------------------------------------------------------------ */

Waiting *waiting_create(void);
void waiting_disturb(Bus *bus);
void waiting_forget(Bus *bus);
/* From now on changes of RAM are noted; whether there was none that has remained. */
void waiting_watch(Bus *bus);
bool waiting_nothing_changed(const Bus *bus);
/* True: the register is to be read again, because it is later now. */
bool waiting_polled(Bus *bus, int64_t position, uint32_t address, int64_t now_ps, int64_t until_ps);
/* A word of RAM is about to change, while passages are kept. */
void waiting_log(Waiting *waiting, uint32_t address, uint32_t old);

#endif
