/* Loads and stores of one register (ARMv7-M ARM A7.7.42 to A7.7.67, A7.7.161 to A7.7.173). */
#include "cpu/transfers.h"

#define DEFINE_ONE_LOAD(name, load, type)                             \
  INLINE bool name(Core *core, const Insn *insn, uint32_t address) {  \
    uint32_t value;                                                   \
    if (UNLIKELY(!load(core, address, &value))) {                     \
      return false;                                                   \
    }                                                                 \
    core->r[insn->d] = (uint32_t)(type)value;                         \
    return true;                                                      \
  }
#define DEFINE_LOAD(name, bits, type)      \
  DEFINE_ONE_LOAD(name, load##bits, type)  \
  DEFINE_ONE_LOAD(name##_slow, load##bits##_slow, type)
DEFINE_LOAD(ldr, 32, uint32_t)
DEFINE_LOAD(ldrh, 16, uint16_t)
DEFINE_LOAD(ldrb, 8, uint8_t)
DEFINE_LOAD(ldrsh, 16, int16_t)
DEFINE_LOAD(ldrsb, 8, int8_t)

/* LDR to SP: bits 1:0 of SP are 0 (B1.4.7). */
#define DEFINE_LOAD_OF_SP(name, load)                                 \
  INLINE bool name(Core *core, const Insn *insn, uint32_t address) {  \
    uint32_t value;                                                   \
    (void)insn;                                                       \
    if (UNLIKELY(!load(core, address, &value))) {                     \
      return false;                                                   \
    }                                                                 \
    core->r[13] = value & ~3u;                                        \
    return true;                                                      \
  }
DEFINE_LOAD_OF_SP(ldr_sp, load32)
DEFINE_LOAD_OF_SP(ldr_sp_slow, load32_slow)

#define DEFINE_STORE(name, bits)                                             \
  INLINE bool name(Core *core, const Insn *insn, uint32_t address) {         \
    return store##bits(core, address, core->r[insn->d]);                     \
  }                                                                          \
  INLINE bool name##_slow(Core *core, const Insn *insn, uint32_t address) {  \
    return store##bits##_slow(core, address, core->r[insn->d]);              \
  }
DEFINE_STORE(str, 32)
DEFINE_STORE(strh, 16)
DEFINE_STORE(strb, 8)

#define DEFINE_STORE_FORMS(access)  \
  DEFINE_FORMS(access)              \
  DEFINE_ACCESS(access##_register, access, core->r[insn->n] + (core->r[insn->m] << insn->shift), )
#define DEFINE_LOAD_FORMS(access) DEFINE_STORE_FORMS(access) DEFINE_LITERAL(access)

DEFINE_STORE_FORMS(str)
DEFINE_STORE_FORMS(strh)
DEFINE_STORE_FORMS(strb)
DEFINE_LOAD_FORMS(ldr)
DEFINE_LOAD_FORMS(ldrh)
DEFINE_LOAD_FORMS(ldrb)
DEFINE_LOAD_FORMS(ldrsh)
DEFINE_LOAD_FORMS(ldrsb)
DEFINE_LOAD_FORMS(ldr_sp)

/* -- literal at a known address: d is in shift -------------------------------------------------------- */

OPERATION(ldr_bytes) {
  __builtin_memcpy(&core->r[insn->shift], insn->bytes, 4);
  NEXT;
}

void make_literal(Insn *insn, const uint8_t *bytes) {
  insn->shift = insn->d;
  insn->bytes = bytes;
  insn->run = ldr_bytes;
}

/* -- LDR to PC: the base is written first ----------------------------------------------------------------- */

#define DEFINE_LOAD_OF_PC(form, to, afterwards)          \
  SLOW_OPERATION(ldr_pc_##form##_slow) {                 \
    uint32_t target, address = to;                       \
    sync_state(core, insn, budget);                      \
    if (load32_slow(core, address, &target)) {           \
      afterwards;                                        \
      resume_chain_at(core, bx_write_pc(core, target));  \
    }                                                    \
  }                                                      \
  OPERATION(ldr_pc_##form) {                             \
    uint32_t target, address = to;                       \
    if (UNLIKELY(!load32(core, address, &target))) {     \
      TAIL ldr_pc_##form##_slow(core, insn, budget);     \
    }                                                    \
    afterwards;                                          \
    const Insn *next = bx_write_pc(core, target);        \
    TAIL enter_block(core, next, budget);                \
  }
DEFINE_LOAD_OF_PC(offset, core->r[insn->n] + insn->imm, )
DEFINE_LOAD_OF_PC(register, core->r[insn->n] + (core->r[insn->m] << insn->shift), )
DEFINE_LOAD_OF_PC(literal, insn->imm, )
DEFINE_LOAD_OF_PC(pre_indexed, core->r[insn->n] + insn->imm, write_base(core, insn, address))
DEFINE_LOAD_OF_PC(post_indexed, core->r[insn->n], write_base(core, insn, address + insn->imm))

#define STORE_FORMS(access)  \
  { access##_offset, access##_register, NULL, access##_pre_indexed, access##_post_indexed }
#define LOAD_FORMS(access)  \
  { access##_offset, access##_register, access##_literal, access##_pre_indexed, access##_post_indexed }

bool decode_transfer(enum Transfer transfer, enum Form form, unsigned d, Insn *insn) {
  static const Operation operations[TRANSFERS][FORMS] = {
      [STR] = STORE_FORMS(str),       [STRH] = STORE_FORMS(strh),     [STRB] = STORE_FORMS(strb),
      [LDRSB] = LOAD_FORMS(ldrsb),    [LDR] = LOAD_FORMS(ldr),        [LDRH] = LOAD_FORMS(ldrh),
      [LDRB] = LOAD_FORMS(ldrb),      [LDRSH] = LOAD_FORMS(ldrsh),    [LDR_SP] = LOAD_FORMS(ldr_sp),
      [LDR_PC] = LOAD_FORMS(ldr_pc),
  };
  if (transfer == LDR) {
    transfer = d == 13 ? LDR_SP : d == 15 ? LDR_PC : LDR;
  }
  insn->d = transfer == LDR_SP || transfer == LDR_PC ? 0 : (uint8_t)d;
  insn->run = operations[transfer][form];
  insn->flags |= transfer == LDR_PC ? ENDS_BLOCK : 0;
  insn->flags |= transfer == LDR && form == LITERAL_FORM ? LITERAL : 0;
  return insn->run != NULL;
}
