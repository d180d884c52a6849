/* LDREX, STREX and those of bytes and half-words, TBB and TBH (ARMv7-M ARM A5.3.6).
 *
 * Decision: STREX fails, too, where the word is no longer what LDREX has read. The monitor may (A3.4.1), and
 * the reference engine does, which has it notice what an exception handler has stored in between.
 */
#include "transfers.h"

/* imm is the offset. An address that is not a multiple of the size always faults (A3.2.1). */
#define DEFINE_EXCLUSIVE(suffix, bits)                                         \
  static void ldrex##suffix(Core *core, const Insn *insn) {                    \
    uint32_t value, address = core->r[insn->n] + insn->imm;                    \
    if (address & (bits / 8 - 1)) {                                            \
      core->fault_address = address;                                           \
      stop_on(core, insn, STOP_UNALIGNED);                                     \
    } else if (load##bits(core, insn, address, &value)) {                      \
      core->exclusive = 1;                                                     \
      core->exclusive_address = address;                                       \
      core->exclusive_value = core->r[insn->d] = value;                        \
    }                                                                          \
  }                                                                            \
  static void strex##suffix(Core *core, const Insn *insn) {                    \
    uint32_t value, address = core->r[insn->n] + insn->imm;                    \
    bool stores = core->exclusive && core->exclusive_address == address;       \
    if (stores) {                                                              \
      if (!load##bits(core, insn, address, &value)) {                          \
        return;                                                                \
      }                                                                        \
      stores = value == core->exclusive_value;                                 \
      if (stores && !store##bits(core, insn, address, core->r[insn->a])) {     \
        return;                                                                \
      }                                                                        \
    }                                                                          \
    core->exclusive = 0;                                                       \
    core->r[insn->d] = !stores;                                                \
  }
DEFINE_EXCLUSIVE(, 32)
DEFINE_EXCLUSIVE(h, 16)
DEFINE_EXCLUSIVE(b, 8)

/* d, which PC and SP may not be, gets what was read or whether it failed; a is stored. */
static bool decode_exclusive(Operation run, unsigned n, unsigned d, unsigned a, Insn *insn) {
  insn->run = run;
  insn->n = n;
  insn->d = d;
  insn->a = a;
  return n != 15 && d != 13 && d != 15;
}

bool decode_exclusive_word(bool load, unsigned n, uint16_t second, Insn *insn) {
  unsigned t = bits(second, 15, 12), d = bits(second, 11, 8);
  insn->imm = 4 * bits(second, 7, 0);
  return load ? d == 15 && decode_exclusive(ldrex, n, t, 0, insn) : decode_exclusive(strex, n, d, t, insn);
}

/* -- TBB, TBH: n is the table, m the index -------------------------------------------------------------- */

#define DEFINE_TABLE_BRANCH(name, bits)                                                          \
  static void name(Core *core, const Insn *insn) {                                               \
    uint32_t half_words;                                                                         \
    if (load##bits(core, insn, core->r[insn->n] + core->r[insn->m] * (bits / 8), &half_words)) { \
      core->r[15] += 2 * half_words;                                                             \
    }                                                                                            \
  }
DEFINE_TABLE_BRANCH(tbb, 8)
DEFINE_TABLE_BRANCH(tbh, 16)

static bool decode_table_branch(Operation run, unsigned n, unsigned m, Insn *insn) {
  insn->run = run;
  insn->n = n; /* may be PC, which is the address of the next instruction as it should */
  insn->m = m;
  return true;
}

bool decode_exclusive_or_table(bool load, unsigned n, uint16_t second, Insn *insn) {
  unsigned t = bits(second, 15, 12), low = bits(second, 3, 0);
  switch (bits(second, 7, 4)) {
  case 0: return load && decode_table_branch(tbb, n, low, insn);
  case 1: return load && decode_table_branch(tbh, n, low, insn);
  case 4: return load ? decode_exclusive(ldrexb, n, t, 0, insn) : decode_exclusive(strexb, n, low, t, insn);
  case 5: return load ? decode_exclusive(ldrexh, n, t, 0, insn) : decode_exclusive(strexh, n, low, t, insn);
  default: return false;
  }
}
