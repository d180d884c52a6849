/* Loads and stores in both encodings. */
#ifndef FCU_TRANSFERS_H
#define FCU_TRANSFERS_H

#include "cpu/access.h"

/* Section A5.2.4 defines the numbers up to LDRSH. */
enum Transfer { STR, STRH, STRB, LDRSB, LDR, LDRH, LDRB, LDRSH, LDR_SP, LDR_PC, TRANSFERS };
/* [n, #imm]  [n, m, LSL #shift]  [#imm]  [n, #imm]!  [n], #imm. */
enum Form { OFFSET, REGISTER, LITERAL_FORM, PRE_INDEXED, POST_INDEXED, FORMS };

/* The caller has set n, m, shift and imm. Stores have no literal form. */
bool decode_transfer(enum Transfer transfer, enum Form form, unsigned d, Insn *insn);
void make_literal(Insn *insn, const uint8_t *bytes);

/* before: true for DB, false for IA. */
bool decode_multiple(bool load, bool before, bool write_back, unsigned n, uint32_t list, Insn *insn);
bool decode_dual(bool load, enum Form form, unsigned n, uint16_t second, uint32_t imm, Insn *insn);

bool decode_exclusive_word(bool load, unsigned n, uint16_t second, Insn *insn);
bool decode_exclusive_or_table(uint32_t address, bool load, unsigned n, uint16_t second, Insn *insn);

/* Bits 1:0 of SP are 0 (B1.4.7). */
static inline void write_base(Core *core, const Insn *insn, uint32_t address) {
  core->r[insn->n] = UNLIKELY(insn->n == 13) ? address & ~3u : address;
}

#define DEFINE_FORMS(access)                                                                             \
  DEFINE_ACCESS(access##_offset, access, core->r[insn->n] + insn->imm, )                                 \
  DEFINE_ACCESS(access##_pre_indexed, access, core->r[insn->n] + insn->imm, write_base(core, insn, address)) \
  DEFINE_ACCESS(access##_post_indexed, access, core->r[insn->n], write_base(core, insn, address + insn->imm))
#define DEFINE_LITERAL(access) DEFINE_ACCESS(access##_literal, access, insn->imm, )

#endif
