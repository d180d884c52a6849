/* A Cortex-M4F: its state, and declarations shared by this folder.
 *
 * Each instruction is decoded once, into an Insn with the function that executes the instruction (ARMv7-M ARM
 * chapter A7). The Insns are kept in basic blocks.
 */
#ifndef FCU_CORE_H
#define FCU_CORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "generated/memory_map.h"

#define LIKELY(condition) __builtin_expect(!!(condition), 1)
#define UNLIKELY(condition) __builtin_expect(!!(condition), 0)

typedef struct Core Core;
typedef struct Insn Insn;
typedef struct DecodeCache DecodeCache;
typedef struct Chip Chip;
typedef struct ValueLog ValueLog;
/* budget: instructions that may begin after the current block (dispatch.h). */
typedef void (*Operation)(Core *core, const Insn *insn, int32_t budget);

/* A decoded instruction, or another step of a block (decode_cache.h). */
struct Insn {
  Operation run;
  union {
    struct {
      uint32_t imm;
      uint8_t d, n, m, a;
    };
    const Insn *next;
    const uint8_t *bytes;
  };
  uint32_t address;
  uint8_t shift;     /* usually a shift distance */
  uint8_t remaining; /* instructions from here to the end of the block */
  uint8_t it;
  uint8_t flags;
};

/* Set by the decoders for the block builder. */
enum InsnFlag {
  PREDICATED = 1,    /* executed only if it_mask is set; field a inverts the mask */
  ENDS_BLOCK = 2,    /* may write PC or end the run */
  DIRECT_BRANCH = 4, /* the target is imm */
  UNCONDITIONAL = 8, /* executed in an IT block whatever its condition */
  IS_IT = 16,        /* imm: ITSTATE */
  READS_PC = 32,     /* has R15 as an operand, which is UNPREDICTABLE */
  WRITES_SP = 64,    /* writes SP or PC, whose lowest bits must be cleared (B1.4.1) */
  LITERAL = 128,     /* loads the word at address imm into d */
};

enum { NPRIV = 1, SPSEL = 2, FPCA = 4, FLOATING_CONTEXT = 12 }; /* CONTROL; the reference engine sets bit 3, too */

enum Shift { LSL, LSR, ASR, ROR, RRX }; /* SRType (A7.4.2) */

/* The reason why a run ended. bare_core.py has a copy of these values. */
enum Stop {
  STOP_SLICE,      /* counter has reached limit */
  STOP_BREAKPOINT, /* pc is at the instruction */
  STOP_WFI,        /* pc is after the instruction, as for STOP_WFE and STOP_SVC */
  STOP_WFE,
  STOP_SVC,
  STOP_BKPT,             /* pc is at the instruction */
  STOP_EXCEPTION_RETURN, /* EXC_RETURN was loaded into PC */
  STOP_UNDEFINED,        /* pc is at the instruction, as for all stops below */
  STOP_INVALID_STATE,
  STOP_NO_COPROCESSOR,
  STOP_UNALIGNED,
  STOP_DIVIDE_BY_ZERO,
  STOP_FETCH, /* the caller checks for execute-never */
  STOP_READ,
  STOP_WRITE,
};

enum SlowStores { STORES_CHECKED = 1, STORES_LOGGED = 2, STORES_CHANGE_CODE = 4 };

#define MEMORIES 4

/* Flash, its alias at 0, RAM, or system memory. */
typedef struct {
  uint32_t base, size;
  uint8_t *bytes;
  uint32_t *blocks;    /* index: half-word; value: offset of the block that begins there, or 0 */
  uint8_t *code_flags; /* by half-word: enum CodeFlag */
  bool writable;
} Memory;

struct Core {
  uint64_t counter; /* instructions begun in this run */
  uint64_t limit;   /* value of counter at which the run ends */
  uint32_t thumb;
  uint32_t stop;
  uint32_t fault_address;
  uint32_t step_over; /* address of a breakpoint to ignore */
  uint32_t fpu_on;
  uint32_t div_0_trp;
  uint32_t unalign_trp;

  uint64_t chain_end;
  uint64_t chain_limit; /* maximum of chain_end */
  const Insn *insns;
  const Insn *unresolved_link; /* the unresolved link at which the last chain ended, or NULL */
  uint8_t *ram;
  const uint8_t *flash;
  /* Offsets below which access.h needs no check; 0: check all. */
  uint32_t ram_load_limit, ram_store_limit, flash_load_limit;
  uint32_t it_mask; /* -1 if the condition holds, else 0 */
  uint32_t slow_stores;
  /* Together with the memory, the CORE_STATE_SIZE bytes from here to fpscr determine a program's
     behaviour. */
  uint32_t r[16]; /* 13: SP in use; 15: next instruction */
  union {
    struct {
      uint32_t z, c; /* Z is z == 0 */
    };
    uint64_t zc; /* a sum of 33 bits */
  };
  uint32_t n, v; /* the flag is bit 31 */
  uint32_t q, ge;
  uint32_t itstate; /* 0 outside of IT blocks */
  uint32_t ipsr;
  uint32_t primask, basepri, faultmask, control;
  uint32_t sp[2]; /* MSP and PSP; the value of the pointer in use is outdated */
  uint32_t s[32];
  uint32_t fpscr;
  uint32_t exclusive, exclusive_address, exclusive_value; /* local monitor (A3.4.1) */
  Chip *chip;
  DecodeCache *decode_cache;
  Memory code; /* the memory at PC */
  Memory memory[MEMORIES];
  ValueLog *value_log; /* NULL: none */
  uint32_t watching;
  uint32_t watch_begin, watch_end;
};

#define CORE_STATE_SIZE (offsetof(Core, exclusive) - offsetof(Core, r))

/* -- run_loop.c ------------------------------------------------------------------------------------------ */

/* End the run at this count. Call this function in an access or at the end of a chain. */
static inline void core_set_limit(Core *core, uint64_t limit) { core->limit = limit; }
/* Return whether an exception is enabled and pending. */
bool core_exception_pending(const Core *core);
/* Handle a change of PRIMASK, BASEPRI or FAULTMASK. */
void core_masks_changed(Core *core);
void core_send_event(Core *core);

void core_invalidate_code(Core *core, uint32_t address, uint32_t size);

/* -- functions of bus.c, after a call of sync_state() -------------------------------------------------- */

/* Return false if the address has no memory; the run then stops at the instruction. size is 1, 2 or 4.
 * Unaligned accesses are split as the bus splits them. A register access may lower core->limit and discard
 * decoded code. */
bool core_read(Core *core, uint32_t address, unsigned size, uint32_t *value);
bool core_write(Core *core, uint32_t address, unsigned size, uint32_t value);
/* Return false after a fault. LDM, STM, LDRD, STRD and VFP transfers must be aligned regardless of CCR
 * (A3.2.1). */
bool core_is_aligned(Core *core, uint32_t address);
/* Discard decoded code that a write to RAM has changed. The fast path of stores is off while decoded code
 * from RAM exists. */
void core_ram_written(Core *core, uint32_t address, uint32_t size);
/* Return NULL for an address outside of the memory. */
const uint8_t *core_bytes_at(const Core *core, uint32_t address, uint32_t size);
void core_trap_unaligned(Core *core, bool on);
/* Pass changes of RAM to poll_skip_log_store(). */
void core_log_stores(Core *core, bool on);
/* Call this after a change of watching, unalign_trp or slow_stores. */
void core_update_fast_limits(Core *core);

bool core_create(Core *core, Chip *chip, uint8_t *flash, uint8_t *ram, uint8_t *system);
void core_destroy(Core *core);
void core_reset(Core *core);

#define THUMB (1u << 24) /* EPSR.T */

uint32_t read_xpsr(const Core *core);
void write_xpsr(Core *core, uint32_t value);
void write_apsr(Core *core, uint32_t value, bool nzcvq, bool ge);
void write_control(Core *core, uint32_t value);
uint32_t read_stack_pointer(const Core *core, bool process);
void write_stack_pointer(Core *core, bool process, uint32_t value);

static inline bool in_handler(const Core *core) { return core->ipsr != 0; }

/* -- decoders: false for an undefined instruction ----------------------------------------------------- */

/* The caller has set insn->it and cleared all other fields. */
bool decode16(uint32_t address, uint16_t first, Insn *insn);
bool decode32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_data16(uint32_t address, uint16_t first, Insn *insn);
bool decode_data32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_memory16(uint32_t address, uint16_t first, Insn *insn);
bool decode_memory32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_control16(uint32_t address, uint16_t first, Insn *insn);
bool decode_control32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_dsp(uint16_t first, uint16_t second, Insn *insn);
/* While CPACR disables the FPU, floating-point instructions call no_coprocessor(). */
bool is_floating_point(uint16_t first, uint16_t second);
void no_coprocessor(Core *core, const Insn *insn, int32_t budget);
bool decode_vfp(uint32_t address, uint16_t first, uint16_t second, Insn *insn);

static inline uint32_t bits(uint32_t word, unsigned high, unsigned low) {
  return word >> low & ((2u << (high - low)) - 1);
}
static inline int32_t sign_extend(uint32_t value, unsigned width) {
  return (int32_t)(value << (32 - width)) >> (32 - width);
}
static inline uint32_t rotate_right(uint32_t value, unsigned by) {
  return by & 31 ? value >> (by & 31) | value << (32 - (by & 31)) : value;
}
static inline void set_nz(Core *core, uint32_t result) { core->n = core->z = result; }
/* ITAdvance() (A7.3.3). */
static inline uint32_t it_advance(uint32_t itstate) {
  return itstate & 7 ? (itstate & 0xE0) | (itstate << 1 & 0x1F) : 0;
}

#endif
