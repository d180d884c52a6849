/* A Cortex-M4F that executes instructions: state, and what the files of this folder need of each other.
 *
 * Each instruction is decoded once, into an Insn with the function that executes it. The functions are the
 * operations of ARMv7-M ARM chapter A7; exceptions are entered and left by whoever calls core_run().
 */
#ifndef FCU_CORE_H
#define FCU_CORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define LIKELY(condition) __builtin_expect(!!(condition), 1)
#define UNLIKELY(condition) __builtin_expect(!!(condition), 0)

typedef struct Core Core;
typedef struct Insn Insn;
typedef struct Bus Bus;
typedef void (*Operation)(Core *core, const Insn *insn);

/* A decoded instruction; what the fields mean is told where it is decoded. */
struct Insn {
  Operation run;       /* NULL: not decoded yet */
  Operation run_in_it; /* the same inside an IT block, where most 16-bit instructions leave the flags alone */
  uint32_t imm;
  uint8_t d, n, m, a;  /* registers */
  uint8_t size;        /* 2 or 4 bytes */
  uint8_t shift, by;   /* SRType (A7.4.2) as enum Shift, and the distance 0..32 */
  uint8_t flags;       /* of the operation's own choice */
  bool place;          /* the run ends in front of it */
  bool always;         /* executed in an IT block whatever the condition */
};

enum Shift { LSL, LSR, ASR, ROR, RRX };

/* Why core_run() has returned; the numbers are known to native_engine.py. */
enum Stop {
  STOP_SLICE,     /* as many instructions as were asked for, or cut short */
  STOP_PLACE,     /* in front of an instruction that was asked for */
  STOP_WFI,       /* behind the instruction */
  STOP_WFE,       /* behind the instruction */
  STOP_SVC,       /* behind the instruction */
  STOP_BKPT,      /* on the instruction */
  STOP_EXCEPTION_RETURN, /* an EXC_RETURN value has been loaded into PC in Handler mode */
  STOP_UNDEFINED, /* on the instruction, as all of the following */
  STOP_INVALID_STATE,
  STOP_NO_COPROCESSOR,
  STOP_UNALIGNED,
  STOP_DIVIDE_BY_ZERO,
  STOP_FETCH,     /* nothing executable there; the caller knows whether it is marked execute-never */
  STOP_READ,
  STOP_WRITE,
  STOP_REFUSED,   /* a hook has refused the instruction, and knows why */
};

enum SlowStores { STORES_ARE_HOOKED = 1, STORES_ARE_LOGGED = 2, STORES_CHANGE_CODE = 4 };

typedef uint64_t (*ReadCallback)(void *context, uint64_t offset, unsigned size, void *unused);
typedef uint64_t (*LookCallback)(int64_t now_ps, uint32_t offset, uint32_t size);
typedef void (*PutCallback)(int64_t now_ps, uint32_t offset, uint32_t size, uint32_t value);
typedef void (*WriteCallback)(void *context, uint64_t offset, unsigned size, uint64_t value, void *unused);
typedef void (*CodeHook)(uint32_t address);
typedef void (*MemoryHook)(uint32_t address, unsigned size, bool is_write);

#define WINDOWS 24
#define MEMORIES 4
#define RAM_BASE 0x20000000u
#define RAM_SIZE 0x10000u
#define PAGE_BITS 10

/* Flash, its alias at 0, RAM, system memory: bytes of our own, decoded where executed. */
typedef struct {
  uint32_t base, size;
  uint8_t *bytes;
  Insn *insns; /* one for each half-word; made when first executed */
  bool writable;
} Memory;

/* Accesses to a range of the address space that call. image: reads take from it instead; it may be NULL. */
typedef struct {
  uint32_t base, size;
  ReadCallback read;
  WriteCallback write;
  LookCallback look; /* these are called instead where the time is known; NULL if they are not wanted */
  PutCallback put;
  const uint8_t *image;
} Window;

struct Core {
  /* What native_engine.py sees, in this order. */
  uint64_t counter; /* instructions begun in this run, the one in flight included */
  uint64_t limit;   /* the last one to be executed */
  uint32_t pc;      /* where the run begins, and where it has ended */
  uint32_t thumb;   /* EPSR.T */
  uint32_t stop;    /* enum Stop */
  uint32_t fault_address;
  uint32_t passing; /* the address of a place that is executed all the same */
  uint32_t ram_is_code; /* until it is, the first instruction in RAM ends the run with STOP_FETCH */
  uint32_t must_stop; /* the run under way has been cut for a reason that is not known here */

  uint64_t wanted;  /* the limit that the run was begun with */
  uint64_t ahead;   /* as long as counter is less, an operation executes the next instruction, too */
  /* From here to fpscr is what a program's course depends on, besides memory: CORE_STATE_SIZE bytes. */
  uint32_t r[16];   /* r[13]: the SP in use; r[15]: address of the next instruction */
  uint32_t n, z;    /* N is bit 31 of n; Z is set when z is 0 */
  uint32_t c, v;    /* 0 or 1 */
  uint32_t q, ge;   /* 0 or 1; four bits */
  uint32_t itstate; /* 0 outside of IT blocks */
  uint32_t ipsr;
  uint32_t primask, basepri, faultmask, control;
  uint32_t sp[2];   /* MSP and PSP; the one in use is r[13] and stale here */
  uint32_t s[32];
  uint32_t fpscr;
  uint32_t exclusive, exclusive_address, exclusive_value; /* the local monitor (A3.4.1) */
  uint32_t slow_stores; /* why stores have to be looked at: enum SlowStores */
  Bus *bus;         /* NULL, or what answers some accesses without a callback */
  uint8_t *ram;
  Memory code;      /* that of the instructions in execution */
  Insn apart[3];    /* an instruction, and nothing behind it */
  Memory memory[MEMORIES];
  Window window[WINDOWS];
  uint32_t windows;
  uint8_t stored[RAM_SIZE >> PAGE_BITS]; /* pages of RAM that were ever stored to */
  uint32_t stored_known; /* of these, how many were told of */
  uint8_t decoded[RAM_SIZE >> PAGE_BITS]; /* pages of RAM in which something was executed */
  /* Hooks make everything slower; NULL where there is none. */
  CodeHook code_hook;
  MemoryHook memory_hook;
  uint32_t code_begin, code_end, data_begin, data_end; /* where they call; the last address is included */
};

#define CORE_STATE_SIZE (offsetof(Core, exclusive) - offsetof(Core, r))

/* -- run.c ---------------------------------------------------------------------------------------------- */

/* Execute until counter reaches limit; core->stop tells why it ended. An IT block is never divided. */
void core_run(Core *core);
/* The same from r[15] on, without what stands around it. */
void core_execute(Core *core);
/* The rest of the IT block that core->itstate speaks of, from PC on. It is executed as a whole (A7.3).
 * Instructions whose condition fails take no time: the reference engine counts so, too. The state of one
 * that was not executed remains. */
void core_it_block(Core *core);
/* An instruction of an IT block has changed PC, or ended the run. ahead: its value in front of the block. */
void core_it_left(Core *core, uint64_t ahead);
/* The next instruction cannot be executed because it would not be Thumb. */
void core_invalid_state(Core *core);
/* Decode again what is executed in so many bytes. */
void core_forget_code(Core *core, uint32_t address, uint32_t size);
/* Whether runs end with STOP_PLACE in front of these instructions. */
void core_set_places(Core *core, const uint32_t *addresses, uint32_t count, bool on);

/* The run ends in front of this instruction, for a reason. Not after a change of PC. */
static inline void stop_on(Core *core, const Insn *insn, enum Stop why) {
  core->r[15] -= insn->size;
  core->stop = why;
  core->limit = core->counter;
}

/* The run ends behind this instruction. */
static inline void stop_behind(Core *core, enum Stop why) {
  core->stop = why;
  core->limit = core->counter;
}

/* -- one instruction after another ---------------------------------------------------------------------- */

/* Most operations execute the next instruction themselves, instead of returning to the loop: a processor
 * predicts where a call goes by the place it is made from, and badly if all are made from one (it took 1.5
 * times as long). It is the last thing they do, which makes it a jump in optimised code; where it is a call,
 * core->ahead bounds the depth. An operation that may have ended the run, or changed limit or code, returns
 * instead, or has made ahead 0 before, as all accesses do that are not plain ones to RAM. */
static inline void execute(Core *core, const Insn *insn) {
  if (LIKELY(core->counter < core->ahead && insn->run)) {
    core->counter++;
    core->r[15] += insn->size;
    insn->run(core, insn);
  }
}

/* The one behind insn. */
static inline void execute_next(Core *core, const Insn *insn) { execute(core, insn + insn->size / 2); }

/* The one at target, and PC goes there. */
static inline void execute_at(Core *core, uint32_t target) {
  uint32_t offset = target - core->code.base;
  core->r[15] = target;
  if (LIKELY(offset < core->code.size)) {
    execute(core, &core->code.insns[offset >> 1]);
  }
}

/* -- memory.c: false if there is nothing, and then the run has been stopped on the instruction ---------- */

/* size is 1, 2 or 4; *value is zero-extended. Unaligned addresses are read as the bus does, in pieces.
 * Constants beside the code are read like RAM; behind all else ahead is 0: who answers may change it all. */
bool memory_read_elsewhere(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t *value);
bool memory_write_elsewhere(Core *core, const Insn *insn, uint32_t address, unsigned size, uint32_t value);
/* Whether words of RAM that change are told to core->bus (waiting_log). */
void core_log_stores(Core *core, bool on);

/* The usual cases at once. Loads and stores of all instructions go through these six. */
#define DEFINE_ACCESS(bits, type)                                                                        \
  static inline bool load##bits(Core *core, const Insn *insn, uint32_t address, uint32_t *value) {       \
    uint32_t offset = address - RAM_BASE;                                                                \
    if (LIKELY(offset <= RAM_SIZE - sizeof(type) && !core->memory_hook)) {                               \
      type data;                                                                                         \
      __builtin_memcpy(&data, core->ram + offset, sizeof data);                                          \
      *value = data;                                                                                     \
      return true;                                                                                       \
    }                                                                                                    \
    return memory_read_elsewhere(core, insn, address, sizeof(type), value);                              \
  }                                                                                                      \
  static inline bool store##bits(Core *core, const Insn *insn, uint32_t address, uint32_t value) {       \
    uint32_t offset = address - RAM_BASE;                                                                \
    uint32_t page = offset >> PAGE_BITS;                                                                 \
    if (LIKELY(offset <= RAM_SIZE - sizeof(type) && !core->slow_stores)) {                               \
      type data = (type)value;                                                                           \
      __builtin_memcpy(core->ram + offset, &data, sizeof data);                                          \
      core->stored[page] = 1;                                                                            \
      core->stored[(offset + sizeof(type) - 1) >> PAGE_BITS] = 1;                                        \
      return true;                                                                                       \
    }                                                                                                    \
    return memory_write_elsewhere(core, insn, address, sizeof(type), value);                             \
  }
DEFINE_ACCESS(8, uint8_t)
DEFINE_ACCESS(16, uint16_t)
DEFINE_ACCESS(32, uint32_t)

/* -- create.c ------------------------------------------------------------------------------------------- */

/* Flash (shown at 0, too), RAM and system memory are the caller's; NULL if there is no memory for it. */
Core *core_create(uint8_t *flash, uint32_t flash_size, uint8_t *ram, uint8_t *system, uint32_t system_size);
void core_destroy(Core *core);

/* -- state.c -------------------------------------------------------------------------------------------- */

/* By number: 0 to 15, then enum Register in state.c. */
void core_read_registers(const Core *core, const int32_t *numbers, uint32_t *values, int32_t count);
void core_write_registers(Core *core, const int32_t *numbers, const uint32_t *values, int32_t count);

uint32_t read_xpsr(const Core *core);
/* All of xPSR, mode and stack pointer included. */
void write_xpsr(Core *core, uint32_t value);
/* Only N, Z, C, V, Q and, if asked for, GE. */
void write_apsr(Core *core, uint32_t value, bool nzcvq, bool ge);
void write_control(Core *core, uint32_t value);
/* MSP, or PSP, whichever is in use. */
uint32_t read_stack_pointer(const Core *core, bool process);
void write_stack_pointer(Core *core, bool process, uint32_t value);

static inline bool in_handler(const Core *core) { return core->ipsr != 0; }

/* -- decode: false if there is no such instruction (the caller makes it UNDEFINED) ---------------------- */

/* address is that of the instruction; insn->size is set, all else is 0. decode.c chooses among the others. */
bool decode16(uint32_t address, uint16_t first, Insn *insn);
bool decode32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_data16(uint32_t address, uint16_t first, Insn *insn);
bool decode_data32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_memory16(uint32_t address, uint16_t first, Insn *insn);
bool decode_memory32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_control16(uint32_t address, uint16_t first, Insn *insn);
bool decode_control32(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_dsp(uint16_t first, uint16_t second, Insn *insn);
bool decode_vfp(uint32_t address, uint16_t first, uint16_t second, Insn *insn);

/* -- small things of the pseudocode --------------------------------------------------------------------- */

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
/* ITAdvance (A7.3.3). */
static inline uint32_t it_advance(uint32_t itstate) {
  return itstate & 7 ? (itstate & 0xE0) | (itstate << 1 & 0x1F) : 0;
}

#endif
