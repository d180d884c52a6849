/* Loads and stores of one register (ARMv7-M ARM A7.7.42 to A7.7.67, A7.7.161 to A7.7.173). */
#include "branch.h"
#include "transfers.h"

#define DEFINE_LOAD(name, bits, type)                                          \
  static inline bool name(Core *core, const Insn *insn, uint32_t address) {   \
    uint32_t value;                                                            \
    if (UNLIKELY(!load##bits(core, insn, address, &value))) {                  \
      return false;                                                            \
    }                                                                          \
    core->r[insn->d] = (uint32_t)(type)value;                                  \
    return true;                                                               \
  }
DEFINE_LOAD(ldr, 32, uint32_t)
DEFINE_LOAD(ldrh, 16, uint16_t)
DEFINE_LOAD(ldrb, 8, uint8_t)
DEFINE_LOAD(ldrsh, 16, int16_t)
DEFINE_LOAD(ldrsb, 8, int8_t)

/* LDR to SP or PC. The base is still to be written when PC is. */
static inline bool ldr_special(Core *core, const Insn *insn, uint32_t address) {
  uint32_t value;
  core->ahead = 0;
  if (!load32(core, insn, address, &value)) {
    return false;
  }
  if (insn->d == 15) {
    branch_exchange(core, value);
  } else {
    core->r[13] = value & ~3u;
  }
  return true;
}

#define DEFINE_STORE(name, bits)                                               \
  static inline bool name(Core *core, const Insn *insn, uint32_t address) {   \
    return store##bits(core, insn, address, core->r[insn->d]);                 \
  }
DEFINE_STORE(str, 32)
DEFINE_STORE(strh, 16)
DEFINE_STORE(strb, 8)

#define DEFINE_REGISTER(access)                                                \
  static void access##_register(Core *core, const Insn *insn) {                \
    if (access(core, insn, core->r[insn->n] + (core->r[insn->m] << insn->by))) { \
      execute_next(core, insn);                                                  \
    }                                                                          \
  }
#define DEFINE_STORE_FORMS(access) DEFINE_FORMS(access) DEFINE_REGISTER(access)
#define DEFINE_LOAD_FORMS(access) DEFINE_STORE_FORMS(access) DEFINE_LITERAL(access)

DEFINE_STORE_FORMS(str)
DEFINE_STORE_FORMS(strh)
DEFINE_STORE_FORMS(strb)
DEFINE_LOAD_FORMS(ldr)
DEFINE_LOAD_FORMS(ldrh)
DEFINE_LOAD_FORMS(ldrb)
DEFINE_LOAD_FORMS(ldrsh)
DEFINE_LOAD_FORMS(ldrsb)
DEFINE_LOAD_FORMS(ldr_special)

#define STORE_FORMS(access) \
  { access##_offset, access##_register, NULL, access##_pre_indexed, access##_post_indexed }
#define LOAD_FORMS(access) \
  { access##_offset, access##_register, access##_literal, access##_pre_indexed, access##_post_indexed }

static const Operation operations[TRANSFERS][FORMS] = {
    [STR] = STORE_FORMS(str),     [STRH] = STORE_FORMS(strh),   [STRB] = STORE_FORMS(strb),
    [LDRSB] = LOAD_FORMS(ldrsb),  [LDR] = LOAD_FORMS(ldr),      [LDRH] = LOAD_FORMS(ldrh),
    [LDRB] = LOAD_FORMS(ldrb),    [LDRSH] = LOAD_FORMS(ldrsh),  [LDR_SPECIAL] = LOAD_FORMS(ldr_special),
};

Operation single_operation(enum Transfer transfer, enum Form form, unsigned d) {
  return operations[transfer == LDR && (d == 13 || d == 15) ? LDR_SPECIAL : transfer][form];
}
