/* The bus matrix (RM0368 section 2): accesses by the core, DMA and debuggers that are more than a plain load or store
 * of memory (access.h), and the loops that wait, which are told by their accesses.
 */
#ifndef FCU_BUS_H
#define FCU_BUS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"
#include "cpu/work.h"

/* -- bus.c ----------------------------------------------------------------------------------------------- */

/* Somebody else than the core (whose accesses core.h has) reads or writes an address, now: DMA, a debugger
 * (fcu_load(), fcu_store()). False where nothing answers. */
bool bus_load(Chip *chip, uint32_t address, unsigned size, uint32_t *value);
bool bus_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- python_registers.c: what Python would only say again ------------------------------------------------------ */

#define MAX_KEPT_READS 1024 /* reads; a power of 2, as the next */
#define FORGOTTEN 4096  /* registers */

typedef struct {
  uint64_t version; /* of what Python has; changes with each call that may change a register of its peripherals */
  struct {
    int64_t until_ps;
    uint64_t version;
    uint32_t address, size, value;
  } reads[MAX_KEPT_READS];
  uint32_t forgotten[FORGOTTEN]; /* address and kind */
  uint8_t silent[PAGES];         /* enum Access */
  uint8_t unclocked[PAGES];      /* peripherals in Python whose clock RCC has switched off */
} PythonRegisters;

/* Kinds of places that are forgotten: reads give 0, writes do nothing, and that has been reported. */
enum Forgotten { WITHOUT_REGISTER = 1, WITHOUT_CLOCK = 2 };

/* What a call of Python answers in chip->until_ps, beside a time: there is nothing at the address (in the whole
 * kilobyte) as long as the clock of its peripheral is as it is, and that will not be reported again. */
#define NOTHING_PS ((int64_t)-2)
#define SILENT_PAGE_PS ((int64_t)-3)

enum Access { READ = 1, WRITTEN = 2 };

/* Registers in Python may be others from now on. */
void python_registers_outdate(Chip *chip);
/* Whether such a place is one of the latest that were reported; it has been. address is that of a word. */
bool python_registers_forgotten(const Chip *chip, uint32_t address, enum Forgotten kind);
void python_registers_forget(Chip *chip, uint32_t address, enum Forgotten kind);
/* A register in Python, by what was read before or by asking; *until_ps as in PeripheralType. Now. */
uint32_t python_load(Chip *chip, uint32_t address, unsigned size, int64_t *until_ps);
void python_store(Chip *chip, uint32_t address, unsigned size, uint32_t value);

/* -- poll_skip.c: loops that poll registers ---------------------------------------------------------------- */

#define POLL_SKIP_INTERESTING 3 /* reads of a register after which it is worth comparing states */
#define POLL_SKIP_VAIN 50       /* passages in vain, one after another, after which it is not */
#define POLL_SKIP_PAUSE 2000    /* reads without comparing then */
#define POLL_SKIP_PASSAGES 64
#define POLL_SKIP_LOGGED 128    /* changes of RAM */
#define POLL_SKIP_POLLED 256    /* registers; a power of 2 */

typedef struct {
  uint8_t state[CORE_STATE_SIZE];
  int64_t position, accesses;
  uint32_t logged;
} Passage;

typedef struct {
  uint32_t address;
  int32_t interest;
  /* What the last read gave, for reads of the same size until until_ps, as long as version is that of PollSkip. */
  uint32_t size, value;
  int64_t until_ps, version;
} Polled;

typedef struct {
  int64_t accesses;   /* that were made so far, of any kind */
  int64_t version;    /* of all registers; another one when one may have changed before its time */
  int64_t skipped;    /* instructions that were counted instead of being executed */
  int64_t enabled;
  int64_t comparing;  /* how many passages are kept */
  int64_t valid_ps;
  uint32_t logged;
  struct {
    uint32_t address, old;
  } log[POLL_SKIP_LOGGED];
  Polled polled[POLL_SKIP_POLLED];
  Passage passages[POLL_SKIP_PASSAGES];
} PollSkip;

/* An access that is no mere look at a register. */
void poll_skip_disturb(Chip *chip);
/* Registers may read differently from now on: events, accesses that are no mere look, another run. */
static inline void poll_skip_outdate(PollSkip *poll_skip) { poll_skip->version++; }
/* Where a register is kept. Registers of different peripherals have the same low bits: the multiplication spreads them
 * (Knuth, The Art of Computer Programming, 6.4). */
static inline Polled *poll_skip_slot(PollSkip *poll_skip, uint32_t address) {
  return &poll_skip->polled[(address * 0x9E3779B1u >> 16) % POLL_SKIP_POLLED];
}
/* Something has happened that the next iteration need not repeat. */
void poll_skip_forget(Chip *chip);
/* From now on changes of RAM are noted; whether there was none that has remained. */
void poll_skip_watch(Chip *chip);
bool poll_skip_nothing_changed(const Chip *chip);
/* A register has been read, which will be the same until until_ps. True: it is later now, read it again. */
bool poll_skip_polled(Chip *chip, uint32_t address, int64_t until_ps);
/* A word of RAM is about to change, while passages are kept. */
void poll_skip_log(Chip *chip, uint32_t address, uint32_t old);

/* -- idle_skip.c: loops that poll variables ------------------------------------------------------------------- */

#define IDLE_SKIP_SLOTS 1024 /* instructions in known loops; a power of 2 */

typedef struct {
  struct {
    uint32_t address;
    uint16_t period; /* instructions of an iteration; 0: none is known */
    uint16_t vain;   /* iterations, one after another, that have repeated nothing */
  } places[IDLE_SKIP_SLOTS];
  int64_t next_look; /* how long a run may be that is looked at */
  int64_t accesses, not_before;
  uint32_t suspect; /* the address of an instruction in a loop to be looked at; 1: none */
  int32_t failures;
} IdleSkip;

void idle_skip_create(Chip *chip);
/* Execute or skip up to so many instructions where the core is in a loop that is known or suspected; false: it is in
 * none, and nothing has been done. */
bool idle_skip_execute(Chip *chip, int64_t instructions);
/* After a run of instructions: suspect a loop where nothing was accessed; look half as often as long as that goes
 * on. */
void idle_skip_look(Chip *chip);

#endif
