/* LDREX, STREX, TBB and TBH in all sizes (ARMv7-M ARM A5.3.6).
 *
 * Decision: STREX also fails if the word has changed since LDREX read it. The architecture allows
 * this (A3.4.1), and the reference engine does the same. So STREX also detects a store by an exception handler
 * between LDREX and STREX.
 */
#include "cpu/transfers.h"

/* imm: offset. Unaligned addresses always fault (A3.2.1). */
#define DEFINE_EXCLUSIVE(suffix, size)                                     \
  OPERATION(ldrex##suffix) {                                               \
    uint32_t value, address = core->r[insn->n] + insn->imm;                \
    sync_state(core, insn, budget);                                        \
    if (address % size) {                                                  \
      core->fault_address = address;                                       \
      stop_at(core, insn, budget, STOP_UNALIGNED);                         \
    } else if (core_read(core, address, size, &value)) {                   \
      core->exclusive = 1;                                                 \
      core->exclusive_address = address;                                   \
      core->exclusive_value = core->r[insn->d] = value;                    \
      resume_chain(core, insn);                                            \
    }                                                                      \
  }                                                                        \
  OPERATION(strex##suffix) {                                               \
    uint32_t value, address = core->r[insn->n] + insn->imm;                \
    bool stores = core->exclusive && core->exclusive_address == address;   \
    sync_state(core, insn, budget);                                        \
    if (stores) {                                                          \
      if (!core_read(core, address, size, &value)) {                       \
        return;                                                            \
      }                                                                    \
      stores = value == core->exclusive_value;                             \
      if (stores && !core_write(core, address, size, core->r[insn->a])) {  \
        return;                                                            \
      }                                                                    \
    }                                                                      \
    core->exclusive = 0;                                                   \
    core->r[insn->d] = !stores;                                            \
    resume_chain(core, insn);                                              \
  }
DEFINE_EXCLUSIVE(, 4)
DEFINE_EXCLUSIVE(h, 2)
DEFINE_EXCLUSIVE(b, 1)

/* d: the value read, or the status; a: the value to store. */
static bool decode_exclusive(Operation run, unsigned n, unsigned d, unsigned a, Insn *insn) {
  insn->run = run;
  insn->n = (uint8_t)n;
  insn->d = (uint8_t)d;
  insn->a = (uint8_t)a;
  return n != 15 && d != 13 && d != 15;
}

bool decode_exclusive_word(bool load, unsigned n, uint16_t second, Insn *insn) {
  unsigned t = bits(second, 15, 12), d = bits(second, 11, 8);
  insn->imm = 4 * bits(second, 7, 0);
  return load ? d == 15 && decode_exclusive(ldrex, n, t, 0, insn) : decode_exclusive(strex, n, d, t, insn);
}

/* -- TBB, TBH: table at n or imm, index m ------------------------------------------------------------- */

#define DEFINE_TABLE_BRANCH(name, bits, base)                                   \
  SLOW_OPERATION(name##_slow) {                                                 \
    uint32_t half_words, address = base + core->r[insn->m] * (bits / 8);        \
    sync_state(core, insn, budget);                                             \
    if (load##bits##_slow(core, address, &half_words)) {                        \
      resume_chain_at(core, block_at(core, insn[1].address + 2 * half_words));  \
    }                                                                           \
  }                                                                             \
  OPERATION(name) {                                                             \
    uint32_t half_words, address = base + core->r[insn->m] * (bits / 8);        \
    if (UNLIKELY(!load##bits(core, address, &half_words))) {                    \
      TAIL name##_slow(core, insn, budget);                                     \
    }                                                                           \
    const Insn *next = block_at(core, insn[1].address + 2 * half_words);        \
    TAIL enter_block(core, next, budget);                                       \
  }
DEFINE_TABLE_BRANCH(tbb, 8, core->r[insn->n])
DEFINE_TABLE_BRANCH(tbh, 16, core->r[insn->n])
DEFINE_TABLE_BRANCH(tbb_pc, 8, insn->imm)
DEFINE_TABLE_BRANCH(tbh_pc, 16, insn->imm)

static bool decode_table_branch(uint32_t address, bool wide, unsigned n, unsigned m, Insn *insn) {
  static const Operation operations[2][2] = {{tbb, tbh}, {tbb_pc, tbh_pc}};
  bool at_pc = n == 15;
  insn->run = operations[at_pc][wide];
  insn->n = at_pc ? 0 : (uint8_t)n;
  insn->m = (uint8_t)m;
  insn->imm = address + 4;
  insn->flags |= ENDS_BLOCK;
  return true;
}

bool decode_exclusive_or_table(uint32_t address, bool load, unsigned n, uint16_t second, Insn *insn) {
  unsigned t = bits(second, 15, 12), low = bits(second, 3, 0);
  switch (bits(second, 7, 4)) {
  case 0:
  case 1: return load && decode_table_branch(address, bits(second, 4, 4), n, low, insn);
  case 4: return load ? decode_exclusive(ldrexb, n, t, 0, insn) : decode_exclusive(strexb, n, low, t, insn);
  case 5: return load ? decode_exclusive(ldrexh, n, t, 0, insn) : decode_exclusive(strexh, n, low, t, insn);
  default: return false;
  }
}
