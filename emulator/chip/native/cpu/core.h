/* A Cortex-M4F that executes instructions: its state, and the functions shared by the files of this folder.
 *
 * Each instruction is decoded once, into an Insn with the function that executes it. Insns are kept in basic blocks,
 * together with the instructions that follow. The functions implement the operations of ARMv7-M ARM chapter A7.
 * exceptions.c implements exception entry and return.
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
/* budget: how many instructions may still begin after the current block (dispatch.h). */
typedef void (*Operation)(Core *core, const Insn *insn, int32_t budget);

/* A decoded instruction, or a step between two of them (decode_cache.h). The decoders document the fields. */
struct Insn {
  Operation run;
  union {
    struct {
      uint32_t imm;
      uint8_t d, n, m, a; /* registers */
    };
    const Insn *next;     /* of links: the next step */
    const uint8_t *bytes; /* of loads from a fixed address: the bytes there */
  };
  uint32_t address;
  uint8_t shift;   /* usually the distance of a shift, 0..32 */
  uint8_t remaining; /* instructions from this one to the end of the block, both included */
  uint8_t it;   /* ITSTATE during execution; 0 outside of IT blocks */
  uint8_t flags; /* enum Kind */
};

/* Properties used when building a basic block, set by the decoders. */
enum InsnFlag {
  PREDICATED = 1,     /* of an IT block: does nothing unless core->mask, with bits a inverted, has all bits set */
  ENDS_BLOCK = 2,       /* writes PC or ends the run, or may do so */
  DIRECT_BRANCH = 4,      /* a branch to the address imm */
  UNCONDITIONAL = 8,     /* executed in an IT block regardless of the condition */
  IS_IT = 16,     /* imm: the initial ITSTATE */
  READS_PC = 32,  /* if the manual says UNPREDICTABLE */
  WRITES_SP = 64, /* or PC: d is 13 or 15, whose lowest bits are to be cleared afterwards (B1.4.1) */
  LITERAL = 128,  /* a load of the word at the address imm to d */
};

enum Shift { LSL, LSR, ASR, ROR, RRX }; /* SRType (A7.4.2) */

/* The reason why a run of instructions ended; bare_core.py has the same numbers. */
enum Stop {
  STOP_SLICE,     /* the requested number of instructions, or fewer after fcu_cut() */
  STOP_BREAKPOINT,     /* before an instruction with a breakpoint */
  STOP_WFI,       /* after the instruction */
  STOP_WFE,       /* after the instruction */
  STOP_SVC,       /* after the instruction */
  STOP_BKPT,      /* on the instruction */
  STOP_EXCEPTION_RETURN, /* an EXC_RETURN value has been loaded into PC in Handler mode */
  STOP_UNDEFINED, /* on the instruction, as in all following cases */
  STOP_INVALID_STATE,
  STOP_NO_COPROCESSOR,
  STOP_UNALIGNED,
  STOP_DIVIDE_BY_ZERO,
  STOP_FETCH,     /* no executable code there; the caller checks for execute-never regions */
  STOP_READ,
  STOP_WRITE,
};

enum SlowStores { STORES_CHECKED = 1, STORES_LOGGED = 2, STORES_CHANGE_CODE = 4 };

#define MEMORIES 4

/* A memory with code: flash, its alias at 0, RAM, system memory. Code is decoded when it is executed. */
typedef struct {
  uint32_t base, size;
  uint8_t *bytes;
  uint32_t *blocks; /* for each half-word the block that begins there, as a distance in bytes; 0: not yet decoded */
  uint8_t *code_flags;  /* for each half-word: enum Mark */
  bool writable;
} Memory;

struct Core {
  uint64_t counter; /* instructions begun in this run, the one in flight included */
  uint64_t limit;   /* the last instruction of the run, as a value of counter */
  uint32_t thumb;   /* EPSR.T */
  uint32_t stop;    /* enum Stop */
  uint32_t fault_address;
  uint32_t step_over; /* the address of a breakpoint to step over */
  uint32_t fpu_on;      /* CPACR enables floating-point instructions */
  uint32_t div_0_trp;   /* CCR.DIV_0_TRP */
  uint32_t unalign_trp; /* CCR.UNALIGN_TRP */

  uint64_t chain_end;   /* counter plus budget of the current chain (dispatch.h) */
  uint64_t chain_limit;  /* the maximum of end */
  const Insn *insns;    /* the storage of all blocks */
  const Insn *unresolved_link; /* the link that was just left because it had no destination yet; or NULL */
  uint8_t *ram;
  const uint8_t *constants; /* flash */
  /* Offsets below which loads and stores need no check (access.h); 0 if all must be checked. */
  uint32_t ram_load_limit, ram_store_limit, flash_load_limit;
  uint32_t it_mask;      /* all bits or none: the condition of the current IT block */
  uint32_t slow_stores; /* why stores must be checked: enum SlowStores */
  /* From here to fpscr: the state that determines a program's course, besides memory. CORE_STATE_SIZE bytes. */
  uint32_t r[16];   /* r[13]: the SP in use; r[15]: address of the next instruction */
  union {
    struct {
      uint32_t z, c; /* Z is set when z is 0; c is 0 or 1 */
    };
    uint64_t zc;     /* both: a sum of 33 bits (host and chip are little-endian) */
  };
  uint32_t n, v;    /* bit 31 of each is the flag */
  uint32_t q, ge;   /* 0 or 1; four bits */
  uint32_t itstate; /* 0 outside of IT blocks */
  uint32_t ipsr;
  uint32_t primask, basepri, faultmask, control;
  uint32_t sp[2];   /* MSP and PSP; the one in use is r[13] and stale here */
  uint32_t s[32];
  uint32_t fpscr;
  uint32_t exclusive, exclusive_address, exclusive_value; /* the local monitor (A3.4.1) */
  Chip *chip;       /* answers accesses to registers */
  DecodeCache *decode_cache;
  Memory code;      /* the memory of the current instructions */
  Memory memory[MEMORIES];
  uint32_t watching; /* loads and stores from data_begin to data_end are reported: fcu_watch_memory() */
  uint32_t watch_begin, watch_end; /* the last address is included */
};

#define CORE_STATE_SIZE (offsetof(Core, exclusive) - offsetof(Core, r))

/* -- run_loop.c ------------------------------------------------------------------------------------------ */

/* In an access or an instruction that ends a chain: set the number of instructions after which the run ends. */
static inline void core_set_limit(Core *core, uint64_t limit) { core->limit = limit; }
/* An exception is pending that a change of PRIMASK, BASEPRI or FAULTMASK may allow; one of these has changed. */
bool core_exception_pending(const Core *core);
void core_masks_changed(Core *core);
/* Send an event to the core (SEV). */
void core_send_event(Core *core);

/* -- decode_cache.c ------------------------------------------------------------------------------------------- */

/* Discard the decoded instructions of this range of bytes. */
void core_invalidate_code(Core *core, uint32_t address, uint32_t size);

/* -- bus.c: at the exact counter and PC (dispatch.h, look_outside) ------------------------------------------ */

/* Return false if no memory is there; the run then stops on the instruction. size is 1, 2 or 4; *value is
 * zero-extended. Unaligned addresses are read in pieces, as on the bus. The peripheral may change limit and code. */
bool core_read(Core *core, uint32_t address, unsigned size, uint32_t *value);
bool core_write(Core *core, uint32_t address, unsigned size, uint32_t value);
/* Return false for a fault: LDM, STM, LDRD, STRD and VLDM, VSTM, VLDR, VSTR fault at an address that is not a
 * multiple of 4, regardless of CCR (A3.2.1). */
bool core_is_aligned(Core *core, uint32_t address);
/* Bytes of RAM have been stored by DMA or a debugger. */
void core_ram_written(Core *core, uint32_t address, uint32_t size);
/* Return size bytes of memory; NULL if the address is not in the chip's memories. */
const uint8_t *core_bytes_at(const Core *core, uint32_t address, uint32_t size);
/* Set CCR.UNALIGN_TRP. */
void core_trap_unaligned(Core *core, bool on);
/* Select if changed words of RAM are reported to poll_skip_log(). */
void core_log_stores(Core *core, bool on);
/* Call this after a change of the conditions that make loads and stores slow. */
void core_update_fast_limits(Core *core);

/* -- create.c ------------------------------------------------------------------------------------------- */

/* Flash (mapped at 0, too), RAM and system memory are the chip's. False if the host has no memory for decoded code. */
bool core_create(Core *core, Chip *chip, uint8_t *flash, uint8_t *ram, uint8_t *system);
void core_destroy(Core *core);
/* All registers 0. */
void core_reset(Core *core);

/* -- state.c -------------------------------------------------------------------------------------------- */

uint32_t read_xpsr(const Core *core);
/* Write all of xPSR, including mode and stack pointer. */
void write_xpsr(Core *core, uint32_t value);
/* Write N, Z, C, V and Q (nzcvq), GE (ge), or both. */
void write_apsr(Core *core, uint32_t value, bool nzcvq, bool ge);
void write_control(Core *core, uint32_t value);
/* Return MSP or PSP, including the one in use. */
uint32_t read_stack_pointer(const Core *core, bool process);
void write_stack_pointer(Core *core, bool process, uint32_t value);

static inline bool in_handler(const Core *core) { return core->ipsr != 0; }

/* -- decode: false for an unknown instruction (the caller makes it UNDEFINED) --------------------------- */

/* Decode one instruction at `address`. insn->it is set, all else is 0. decode.c selects the decoder. */
bool decode16(uint32_t address, uint16_t first, Insn *insn);
bool decode32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_data16(uint32_t address, uint16_t first, Insn *insn);
bool decode_data32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_memory16(uint32_t address, uint16_t first, Insn *insn);
bool decode_memory32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_control16(uint32_t address, uint16_t first, Insn *insn);
bool decode_control32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_dsp(uint16_t first, uint16_t second, Insn *insn);
/* While CPACR disables the FPU, its instructions execute no_coprocessor(). */
bool is_floating_point(uint16_t first, uint16_t second);
void no_coprocessor(Core *core, const Insn *insn, int32_t budget);
bool decode_vfp(uint32_t address, uint16_t first, uint16_t second, Insn *insn);

/* -- small functions of the pseudocode ------------------------------------------------------------------ */

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
/* ITAdvance() of the manual (A7.3.3). */
static inline uint32_t it_advance(uint32_t itstate) {
  return itstate & 7 ? (itstate & 0xE0) | (itstate << 1 & 0x1F) : 0;
}

#endif
