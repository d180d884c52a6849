/* Loads and stores: declarations shared by the decoders of 16 and 32 bits. */
#ifndef FCU_TRANSFERS_H
#define FCU_TRANSFERS_H

#include "cpu/access.h"

/* -- single.c: one register ----------------------------------------------------------------------------- */

/* The first eight have the numbers of the 16-bit encoding (A5.2.4). */
enum Transfer { STR, STRH, STRB, LDRSB, LDR, LDRH, LDRB, LDRSH, LDR_SP, LDR_PC, TRANSFERS };
/* The source of the address, with Insn's n, m, by and imm:
 *   [n, #imm]   [n, m, LSL #by]   [#imm]   [n, #imm]!   [n], #imm; imm is negative for those that subtract. */
enum Form { OFFSET, REGISTER, LITERAL_FORM, PRE_INDEXED, POST_INDEXED, FORMS };

/* d is the transferred register; the caller sets n, m, by and imm. False: stores have no literal form. */
bool decode_transfer(enum Transfer transfer, enum Form form, unsigned d, Insn *insn);
/* Make insn an LDR of a literal, whose word is at `bytes`. */
void make_literal(Insn *insn, const uint8_t *bytes);

/* -- multiple.c: several of them ------------------------------------------------------------------------ */

/* before: DB instead of IA. */
bool decode_multiple(bool load, bool before, bool write_back, unsigned n, uint32_t list, Insn *insn);
/* LDRD and STRD: form is OFFSET, LITERAL_FORM (imm: the address), PRE_INDEXED or POST_INDEXED. */
bool decode_dual(bool load, enum Form form, unsigned n, uint16_t second, uint32_t imm, Insn *insn);

/* -- exclusive.c ---------------------------------------------------------------------------------------- */

/* LDREX and STREX with an offset, then those of bytes and half-words, TBB and TBH. */
bool decode_exclusive_word(bool load, unsigned n, uint16_t second, Insn *insn);
bool decode_exclusive_or_table(uint32_t address, bool load, unsigned n, uint16_t second, Insn *insn);

/* -- both ----------------------------------------------------------------------------------------------- */

/* Bits 1:0 of SP are always 0 (B1.4.7). */
static inline void write_base(Core *core, const Insn *insn, uint32_t address) {
  core->r[insn->n] = UNLIKELY(insn->n == 13) ? address & ~3u : address;
}

#define DEFINE_FORMS(access)                                                                             \
  DEFINE_ACCESS(access##_offset, access, core->r[insn->n] + insn->imm, )                                 \
  DEFINE_ACCESS(access##_pre_indexed, access, core->r[insn->n] + insn->imm, write_base(core, insn, address)) \
  DEFINE_ACCESS(access##_post_indexed, access, core->r[insn->n], write_base(core, insn, address + insn->imm))
#define DEFINE_LITERAL(access) DEFINE_ACCESS(access##_literal, access, insn->imm, )

#endif
