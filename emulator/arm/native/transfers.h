/* Loads and stores: what the decoders of 16 and of 32 bits share. */
#ifndef FCU_TRANSFERS_H
#define FCU_TRANSFERS_H

#include "core.h"

/* -- single.c: one register ----------------------------------------------------------------------------- */

/* The first eight as 16-bit instructions number them (A5.2.4). */
enum Transfer { STR, STRH, STRB, LDRSB, LDR, LDRH, LDRB, LDRSH, LDR_SPECIAL, TRANSFERS };
/* Where the address comes from, with Insn's n, m, by and imm:
 * [n, #imm]   [n, m, LSL #by]   [#imm]   [n, #imm]!   [n], #imm; imm is negative for those that subtract. */
enum Form { OFFSET, REGISTER, LITERAL, PRE_INDEXED, POST_INDEXED, FORMS };

/* Insn's d is the register that is transferred; of LDR to SP or PC, too. NULL: stores have no literal. */
Operation single_operation(enum Transfer transfer, enum Form form, unsigned d);

/* -- multiple.c: several of them. These decode, too, and are false if there is no such instruction ------ */

/* before: DB rather than IA. */
bool decode_multiple(bool load, bool before, bool write_back, unsigned n, uint32_t list, Insn *insn);
/* LDRD and STRD: form is OFFSET, LITERAL (imm: the address), PRE_INDEXED or POST_INDEXED. */
bool decode_dual(bool load, enum Form form, unsigned n, uint16_t second, uint32_t imm, Insn *insn);

/* -- exclusive.c ---------------------------------------------------------------------------------------- */

/* LDREX and STREX with an offset, then those of bytes and half-words, TBB and TBH. */
bool decode_exclusive_word(bool load, unsigned n, uint16_t second, Insn *insn);
bool decode_exclusive_or_table(bool load, unsigned n, uint16_t second, Insn *insn);

/* -- both ----------------------------------------------------------------------------------------------- */

/* Bits 1:0 of SP are always 0 (B1.4.7). */
static inline void write_base(Core *core, const Insn *insn, uint32_t address) {
  core->r[insn->n] = UNLIKELY(insn->n == 13) ? address & ~3u : address;
}

/* The forms of an access, bool access(core, insn, address). The base is written only behind one that was
 * made: a fault leaves it as it was. */
#define DEFINE_FORMS(access)                                                   \
  static void access##_offset(Core *core, const Insn *insn) {                  \
    if (access(core, insn, core->r[insn->n] + insn->imm)) {                    \
      execute_next(core, insn);                                                \
    }                                                                          \
  }                                                                            \
  static void access##_pre_indexed(Core *core, const Insn *insn) {             \
    uint32_t address = core->r[insn->n] + insn->imm;                           \
    if (access(core, insn, address)) {                                         \
      write_base(core, insn, address);                                         \
      execute_next(core, insn);                                                \
    }                                                                          \
  }                                                                            \
  static void access##_post_indexed(Core *core, const Insn *insn) {            \
    uint32_t address = core->r[insn->n];                                       \
    if (access(core, insn, address)) {                                         \
      write_base(core, insn, address + insn->imm);                             \
      execute_next(core, insn);                                                \
    }                                                                          \
  }
#define DEFINE_LITERAL(access)                                                 \
  static void access##_literal(Core *core, const Insn *insn) {                 \
    if (access(core, insn, insn->imm)) {                                       \
      execute_next(core, insn);                                                \
    }                                                                          \
  }

#endif
