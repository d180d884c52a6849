/* MOVT, bit fields, saturation, packing (ARMv7-M ARM A7.7). */
#include "cpu/operations.h"

OPERATION(movt) {
  core->r[insn->d] = insn->imm << 16 | (core->r[insn->d] & 0xFFFF);
  NEXT;
}

/* -- bit fields; imm: mask of the width; shift: lowest bit -------------------------------------------- */

OPERATION(ubfx) {
  core->r[insn->d] = core->r[insn->n] >> insn->shift & insn->imm;
  NEXT;
}

OPERATION(sbfx) {
  uint32_t field = core->r[insn->n] >> insn->shift & insn->imm;
  uint32_t sign = insn->imm - (insn->imm >> 1);
  core->r[insn->d] = (field ^ sign) - sign;
  NEXT;
}

OPERATION(bfi) {
  uint32_t kept = core->r[insn->d] & ~(insn->imm << insn->shift);
  core->r[insn->d] = kept | (core->r[insn->n] & insn->imm) << insn->shift;
  NEXT;
}

OPERATION(bfc) {
  core->r[insn->d] = core->r[insn->d] & ~(insn->imm << insn->shift);
  NEXT;
}

static bool decode_field(Operation run, unsigned msb, Insn *insn) {
  if (msb > 31 || msb < insn->shift) { /* UNPREDICTABLE */
    return false;
  }
  insn->imm = (2u << (msb - insn->shift)) - 1;
  insn->run = run;
  return true;
}

/* -- saturation (A2.2.1): imm is the highest value ---------------------------------------------------- */

static inline uint32_t saturate(Core *core, int32_t value, int32_t low, uint32_t imm) {
  int32_t high = (int32_t)imm;
  int32_t result = value < low ? low : value > high ? high : value;
  core->q |= result != value;
  return (uint32_t)result;
}

#define DEFINE_SATURATION(name, low)                                    \
  OPERATION(name##_lsl) {                                               \
    int32_t n = (int32_t)(core->r[insn->n] << insn->shift);             \
    core->r[insn->d] = saturate(core, n, low, insn->imm);               \
    NEXT;                                                               \
  }                                                                     \
  OPERATION(name##_asr) {                                               \
    int32_t n = (int32_t)core->r[insn->n] >> insn->shift;               \
    core->r[insn->d] = saturate(core, n, low, insn->imm);               \
    NEXT;                                                               \
  }                                                                     \
  OPERATION(name##16) {                                                 \
    uint32_t n = core->r[insn->n];                                      \
    uint32_t bottom = saturate(core, (int16_t)n, low, insn->imm);       \
    uint32_t top = saturate(core, (int16_t)(n >> 16), low, insn->imm);  \
    core->r[insn->d] = top << 16 | (bottom & 0xFFFF);                   \
    NEXT;                                                               \
  }
DEFINE_SATURATION(ssat, ~(int32_t)insn->imm)
DEFINE_SATURATION(usat, 0)

static bool decode_saturation(bool is_unsigned, bool by_asr, uint16_t second, Insn *insn) {
  unsigned to = bits(second, 4, 0);
  insn->imm = (1u << to) - 1;
  if (by_asr && insn->shift == 0) {
    insn->run = is_unsigned ? usat16 : ssat16;
  } else if (by_asr) {
    insn->run = is_unsigned ? usat_asr : ssat_asr;
  } else {
    insn->run = is_unsigned ? usat_lsl : ssat_lsl;
  }
  return true;
}

OPERATION(pkhbt) {
  uint32_t m = core->r[insn->m] << insn->shift;
  core->r[insn->d] = (m & 0xFFFF0000) | (core->r[insn->n] & 0xFFFF);
  NEXT;
}

OPERATION(pkhtb) {
  uint32_t m = (uint32_t)((int64_t)(int32_t)core->r[insn->m] >> insn->shift);
  core->r[insn->d] = (core->r[insn->n] & 0xFFFF0000) | (m & 0xFFFF);
  NEXT;
}

/* -- decoding, after d, n, m -------------------------------------------------------------------------- */

void decode_movt(Insn *insn) {
  insn->n = 0;
  insn->run = movt;
  writes_d(insn);
}

/* Section A5.3.3. data32.c has the other instructions of this section. */
bool decode_bit_field(uint16_t first, uint16_t second, Insn *insn) {
  unsigned low5 = bits(second, 4, 0);
  insn->shift = (uint8_t)(bits(second, 14, 12) << 2 | bits(second, 7, 6));
  writes_d(insn);
  if (bits(first, 10, 10) || bits(second, 5, 5)) { /* should be 0 */
    return false;
  }
  switch (bits(first, 7, 4)) {
  case 0x0: return decode_saturation(false, false, second, insn);
  case 0x2: return decode_saturation(false, true, second, insn);
  case 0x4: return decode_field(sbfx, insn->shift + low5, insn);
  case 0x6:
    if (insn->n == 15) {
      insn->n = 0;
      return decode_field(bfc, low5, insn);
    }
    return decode_field(bfi, low5, insn);
  case 0x8: return decode_saturation(true, false, second, insn);
  case 0xA: return decode_saturation(true, true, second, insn);
  case 0xC: return decode_field(ubfx, insn->shift + low5, insn);
  default: return false;
  }
}

bool decode_pack(uint16_t first, uint16_t second, Insn *insn) {
  bool tb = bits(second, 5, 5);
  unsigned by = bits(second, 14, 12) << 2 | bits(second, 7, 6);
  insn->shift = (uint8_t)(tb && by == 0 ? 32 : by);
  insn->run = tb ? pkhtb : pkhbt;
  writes_d(insn);
  return !bits(first, 4, 4) && !bits(second, 4, 4) && !bits(second, 15, 15);
}
