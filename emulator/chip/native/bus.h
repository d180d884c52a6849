/* The bus matrix (RM0368 section 2): the slow path of loads and stores (the fast path is in access.h), and
 * the skipping of poll and idle loops. */
#ifndef FCU_BUS_H
#define FCU_BUS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"
#include "cpu/work.h"

/* -- bus.c ----------------------------------------------------------------------------------------------- */

/* Access an address for DMA or a debugger at the current time. The core uses core_read() and core_write()
 * instead. Return false if the address has no memory or register. */
bool bus_load(Chip *chip, uint32_t address, unsigned size, uint32_t *value);
bool bus_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- python_registers.c: cache of registers in Python ------------------------------------------------- */

#define CACHED_READS 1024 /* a power of 2, like IGNORED_SLOTS */
#define IGNORED_SLOTS 4096
#define HARMLESS_SLOTS 64

typedef struct {
  uint64_t version; /* is increased when a register in Python may have changed */
  struct {
    int64_t until_ps;
    uint64_t version;
    uint32_t address, size, value;
  } reads[CACHED_READS];
  struct { /* The latest write. A repetition of this write before until_ps has no effect. */
    int64_t until_ps;
    uint64_t version;
    uint32_t address, size, value;
  } repeated;
  uint32_t ignored[IGNORED_SLOTS]; /* address | enum IgnoreReason */
  struct { /* ignored writes that would not have changed their register */
    uint32_t address, value;
  } harmless[HARMLESS_SLOTS];
  uint8_t empty_pages[PAGES];      /* enum Access */
  uint8_t unclocked[PAGES];
} PythonRegisters;

/* The reason why an address reads as 0 and ignores writes. The reason is stored after the access has been
 * reported. */
enum IgnoreReason { NO_REGISTER = 1, READ_WITHOUT_CLOCK = 2, WRITE_WITHOUT_CLOCK = 3 };

/* Values of chip->until_ps after a call of Python. NO_REGISTER_PS: the address has no register.
 * EMPTY_PAGE_PS: the whole kilobyte around the address has no register. */
#define NO_REGISTER_PS ((int64_t)-2)
#define EMPTY_PAGE_PS ((int64_t)-3)

enum Access { ACCESS_READ = 1, ACCESS_WRITE = 2 };

void python_registers_invalidate(Chip *chip);
bool python_registers_is_ignored(const Chip *chip, uint32_t address, enum IgnoreReason kind);
void python_registers_ignore(Chip *chip, uint32_t address, enum IgnoreReason kind);
/* A write to a peripheral without clock is harmless if its value is the register's reset value. A write of
 * another value must be reported. */
bool python_registers_is_harmless(const Chip *chip, uint32_t address, uint32_t value);
void python_registers_set_harmless(Chip *chip, uint32_t address, uint32_t value);
/* PeripheralType explains *until_ps. */
uint32_t python_load(Chip *chip, uint32_t address, unsigned size, int64_t *until_ps);
void python_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- poll_skip.c: loops that poll registers ----------------------------------------------------------- */

#define POLL_SKIP_COMPARE_AFTER 3 /* number of reads of a register before states are compared */
/* POLL_SKIP_MAX_MISSES: number of unsuccessful comparisons before a pause; POLL_SKIP_PAUSE: number of
   reads without comparison during a pause */
#define POLL_SKIP_MAX_MISSES 50
#define POLL_SKIP_PAUSE 2000
#define POLL_SKIP_STATES 64
#define POLL_SKIP_LOGGED 128
#define POLL_SKIP_POLLED 256

typedef struct {
  uint8_t core[CORE_STATE_SIZE];
  int64_t position, accesses;
  uint32_t logged;
} PollState;

typedef struct {
  uint32_t address;
  int32_t poll_count;
  /* The latest value. With this size and version, the value is valid up to the time until_ps. */
  uint32_t size, value;
  int64_t until_ps, version;
} Polled;

typedef struct {
  int64_t accesses;
  int64_t version; /* is increased when a register may have changed before its until_ps */
  int64_t skipped;
  int64_t enabled;
  int64_t state_count;
  int64_t valid_ps;
  uint32_t logged;
  struct {
    uint32_t address, old;
  } log[POLL_SKIP_LOGGED];
  Polled polled[POLL_SKIP_POLLED];
  PollState states[POLL_SKIP_STATES];
} PollSkip;

/* Handle a write, or a read with a side effect: invalidate cached registers and discard the recorded
 * states. */
void poll_skip_side_effect(Chip *chip);
/* Invalidate cached registers after an event, a side effect, or the start of a run. */
static inline void poll_skip_invalidate(PollSkip *poll_skip) { poll_skip->version++; }
/* Multiplicative hash, because registers of different peripherals have the same low bits (Knuth, TAOCP 6.4). */
static inline Polled *poll_skip_slot(PollSkip *poll_skip, uint32_t address) {
  return &poll_skip->polled[(address * 0x9E3779B1u >> 16) % POLL_SKIP_POLLED];
}
void poll_skip_reset(Chip *chip);
/* poll_skip_begin_log() starts to log changes of RAM; poll_skip_ram_unchanged() returns true if RAM has the
 * same contents as when this log began. */
void poll_skip_begin_log(Chip *chip);
bool poll_skip_ram_unchanged(const Chip *chip);
/* Handle a read of a register whose value is constant until until_ps. Return true if time was skipped and
 * the register must be read again. */
bool poll_skip_register_read(Chip *chip, uint32_t address, int64_t until_ps);
/* Log a word of RAM before it changes. */
void poll_skip_log_store(Chip *chip, uint32_t address, uint32_t old);

/* -- idle_skip.c: loops that poll variables ----------------------------------------------------------- */

#define IDLE_SKIP_SLOTS 1024

typedef struct {
  struct {
    uint32_t address;
    uint16_t period; /* number of instructions in an iteration, or 0 if unknown */
    uint16_t misses; /* consecutive iterations that did not repeat the state */
  } loops[IDLE_SKIP_SLOTS];
  int64_t check_interval;
  int64_t accesses, not_before;
  uint32_t suspect; /* an address in a suspected loop, or 1 */
  int32_t failures;
} IdleSkip;

void idle_skip_create(Chip *chip);
/* Execute or skip at most `instructions` instructions in a known or suspected loop. Outside of such a
 * loop, do nothing and return false. */
bool idle_skip_execute(Chip *chip, int64_t instructions);
/* Suspect an idle loop if the latest run was long and accessed nothing. If the run filled the check
 * interval, double this interval up to a limit. While a loop is suspected, the limit is higher. Call this
 * after a run. */
void idle_skip_check(Chip *chip);

#endif
