/* The bus matrix (RM0368 section 2): accesses by the core, DMA and debuggers beyond plain loads and stores of memory
 * (access.h), and the detection of waiting loops by their accesses.
 */
#ifndef FCU_BUS_H
#define FCU_BUS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"
#include "cpu/work.h"

/* -- bus.c ----------------------------------------------------------------------------------------------- */

/* An access at the current time by DMA or a debugger (fcu_load(), fcu_store()); core.h has the core's accesses.
 * False if no memory or register is there. */
bool bus_load(Chip *chip, uint32_t address, unsigned size, uint32_t *value);
bool bus_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- python_registers.c: the cache of Python's registers ------------------------------------------------------- */

#define CACHED_READS 1024 /* reads; a power of 2, like the following limit */
#define IGNORED_SLOTS 4096  /* registers */

typedef struct {
  uint64_t version; /* of Python's registers; changes with each call that may change one of them */
  struct {
    int64_t until_ps;
    uint64_t version;
    uint32_t address, size, value;
  } reads[CACHED_READS];
  uint32_t ignored[IGNORED_SLOTS]; /* address and kind */
  uint8_t empty_pages[PAGES];         /* enum Access */
  uint8_t unclocked[PAGES];      /* peripherals in Python whose clock RCC has switched off */
} PythonRegisters;

/* Kinds of ignored addresses: reads give 0, writes do nothing, and the access has been reported. */
enum IgnoreReason { NO_REGISTER = 1, NO_CLOCK = 2 };

/* Values of chip->until_ps after a call of Python, besides times: no register at the address (or in the whole
 * kilobyte) while the clock of its peripheral is unchanged. It will not be reported again. */
#define NO_REGISTER_PS ((int64_t)-2)
#define EMPTY_PAGE_PS ((int64_t)-3)

enum Access { ACCESS_READ = 1, ACCESS_WRITE = 2 };

/* Discard the cached values of registers in Python. */
void python_registers_invalidate(Chip *chip);
/* True if the address of this word is among the latest reported ones; add it to them. */
bool python_registers_is_ignored(const Chip *chip, uint32_t address, enum IgnoreReason kind);
void python_registers_ignore(Chip *chip, uint32_t address, enum IgnoreReason kind);
/* A register in Python at the current time, from the cache or by a call. *until_ps as in PeripheralType. */
uint32_t python_load(Chip *chip, uint32_t address, unsigned size, int64_t *until_ps);
void python_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- poll_skip.c: loops that poll registers ---------------------------------------------------------------- */

#define POLL_SKIP_COMPARE_AFTER 3 /* reads of a register after which states are compared */
#define POLL_SKIP_MAX_MISSES 50       /* consecutive passages without success, after which comparing pauses */
#define POLL_SKIP_PAUSE 2000    /* reads without comparing during a pause */
#define POLL_SKIP_STATES 64
#define POLL_SKIP_LOGGED 128    /* changes of RAM */
#define POLL_SKIP_POLLED 256    /* registers; a power of 2 */

typedef struct {
  uint8_t core[CORE_STATE_SIZE];
  int64_t position, accesses;
  uint32_t logged;
} PollState;

typedef struct {
  uint32_t address;
  int32_t poll_count;
  /* The value of the last read, valid for reads of the same size until until_ps while version equals PollSkip's. */
  uint32_t size, value;
  int64_t until_ps, version;
} Polled;

typedef struct {
  int64_t accesses;   /* accesses so far, of any kind */
  int64_t version;    /* of all registers; changes when one may have changed before its time */
  int64_t skipped;    /* instructions counted without execution */
  int64_t enabled;
  int64_t state_count;  /* the number of recorded passages */
  int64_t valid_ps;
  uint32_t logged;
  struct {
    uint32_t address, old;
  } log[POLL_SKIP_LOGGED];
  Polled polled[POLL_SKIP_POLLED];
  PollState states[POLL_SKIP_STATES];
} PollSkip;

/* Record an access that is not a side-effect free read of a register. */
void poll_skip_side_effect(Chip *chip);
/* Registers may have changed: after events, accesses with side effects, or another run. */
static inline void poll_skip_invalidate(PollSkip *poll_skip) { poll_skip->version++; }
/* Return the slot of a register. Registers of different peripherals have the same low bits: the multiplication
 * spreads them (Knuth, The Art of Computer Programming, 6.4). */
static inline Polled *poll_skip_slot(PollSkip *poll_skip, uint32_t address) {
  return &poll_skip->polled[(address * 0x9E3779B1u >> 16) % POLL_SKIP_POLLED];
}
/* Discard the recorded passages: the next iteration may differ. */
void poll_skip_reset(Chip *chip);
/* Begin to log changes of RAM; return true if RAM has its original contents (again). */
void poll_skip_begin_log(Chip *chip);
bool poll_skip_ram_unchanged(const Chip *chip);
/* A register has been read that is constant until until_ps. True: time has advanced, read it again. */
bool poll_skip_register_read(Chip *chip, uint32_t address, int64_t until_ps);
/* Log a word of RAM before it changes, while passages are recorded. */
void poll_skip_log_store(Chip *chip, uint32_t address, uint32_t old);

/* -- idle_skip.c: loops that poll variables ------------------------------------------------------------------- */

#define IDLE_SKIP_SLOTS 1024 /* instructions in known loops; a power of 2 */

typedef struct {
  struct {
    uint32_t address;
    uint16_t period; /* instructions of an iteration; 0: unknown */
    uint16_t misses;   /* consecutive iterations that repeated nothing */
  } loops[IDLE_SKIP_SLOTS];
  int64_t check_interval; /* the maximum length of the next run before a check */
  int64_t accesses, not_before;
  uint32_t suspect; /* the address of an instruction in a suspected loop; 1: none */
  int32_t failures;
} IdleSkip;

void idle_skip_create(Chip *chip);
/* Execute or skip at most `instructions` if the core is in a known or suspected loop. False: it is not, and nothing
 * was done. */
bool idle_skip_execute(Chip *chip, int64_t instructions);
/* After a run of instructions: suspect a loop if nothing was accessed. While that continues, check half as often. */
void idle_skip_check(Chip *chip);

#endif
