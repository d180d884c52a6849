/* Shifts by registers, extension, parallel and saturating arithmetic, bits and bytes (ARMv7-M ARM A5.3.12 to
 * A5.3.15).
 *
 * Field shift of an Insn: the rotation before an extension.
 */
#include "cpu/dsp.h"

#include "cpu/operations.h"

#define N core->r[insn->n]
#define M core->r[insn->m]
#define D core->r[insn->d]

/* -- shifts by the lowest byte of m; 0 keeps C (A7.4.2) ----------------------------------------------- */

INLINE uint32_t shifted(Core *core, enum Shift type, uint32_t value, unsigned by, bool set_carry) {
  uint64_t wide; /* bit 32 (LSL) or 31: the final bit that was shifted out */
  unsigned distance = type == ROR ? by & 31 : by < 63 ? by : 63;
  switch (type) {
  case LSL: wide = distance < 63 ? (uint64_t)value << distance : 0; break;
  case LSR: wide = ((uint64_t)value << 32) >> distance; break;
  case ASR: wide = (uint64_t)((int64_t)((uint64_t)value << 32) >> distance); break;
  default: wide = (uint64_t)rotate_right(value, distance) << 32; break;
  }
  uint32_t result = (uint32_t)(type == LSL ? wide : wide >> 32);
  if (set_carry) {
    if (by) {
      core->c = type == LSL ? wide >> 32 & 1 : type == ROR ? result >> 31 : wide >> 31 & 1;
    }
    set_nz(core, result);
  }
  return result;
}
#define DEFINE_SHIFT(name, type)                                  \
  COMPUTATION(name, D = shifted(core, type, N, M & 0xFF, false))  \
  COMPUTATION(name##s, D = shifted(core, type, N, M & 0xFF, true))
DEFINE_SHIFT(lsl, LSL)
DEFINE_SHIFT(lsr, LSR)
DEFINE_SHIFT(asr, ASR)
DEFINE_SHIFT(ror, ROR)

/* -- extension; n = 15: without addition -------------------------------------------------------------- */

static uint32_t rotated(const Core *core, const Insn *insn) { return rotate_right(M, insn->shift); }

#define SXTB(word) ((uint32_t)(int8_t)(word))
#define SXTH(word) ((uint32_t)(int16_t)(word))
#define UXTB(word) ((uint32_t)(uint8_t)(word))
#define UXTH(word) ((uint32_t)(uint16_t)(word))
#define DEFINE_EXTENSION(name, added, extended)         \
  COMPUTATION(name, D = extended(rotated(core, insn)))  \
  COMPUTATION(added, D = N + extended(rotated(core, insn)))
DEFINE_EXTENSION(sxtb, sxtab, SXTB)
DEFINE_EXTENSION(sxth, sxtah, SXTH)
DEFINE_EXTENSION(uxtb, uxtab, UXTB)
DEFINE_EXTENSION(uxth, uxtah, UXTH)

static uint32_t pair(uint32_t high, uint32_t low) { return high << 16 | (low & 0xFFFF); }
#define DEFINE_EXTENSION_OF_TWO(name, added, extended)               \
  OPERATION(name) {                                                  \
    uint32_t word = rotated(core, insn);                             \
    D = pair(extended(word >> 16), extended(word));                  \
    NEXT;                                                            \
  }                                                                  \
  OPERATION(added) {                                                 \
    uint32_t word = rotated(core, insn);                             \
    D = pair((N >> 16) + extended(word >> 16), N + extended(word));  \
    NEXT;                                                            \
  }
DEFINE_EXTENSION_OF_TWO(sxtb16, sxtab16, SXTB)
DEFINE_EXTENSION_OF_TWO(uxtb16, uxtab16, UXTB)

/* -- parallel addition and subtraction ------------------------------------------------------------------ */

enum Result { MODULO, SATURATED, HALVED };
typedef struct {
  unsigned width;
  bool low_subtracts, high_subtracts;
  bool exchanged; /* the half-words of m are exchanged (ASX, SAX) */
} Lanes;

INLINE int32_t lane(uint32_t word, unsigned at, unsigned width, bool is_signed) {
  word = word >> at & ((1u << width) - 1);
  return is_signed ? sign_extend(word, width) : (int32_t)word;
}

static int32_t clamped(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

INLINE void parallel(Core *core, const Insn *insn, Lanes lanes, bool is_signed, enum Result kind) {
  uint32_t n = N, m = lanes.exchanged ? rotate_right(M, 16) : M, result = 0, ge = 0;
  const unsigned width = lanes.width;
  const int32_t range = 1 << width, lowest = is_signed ? -range / 2 : 0;
  for (unsigned at = 0; at < 32; at += width) {
    bool subtract = at < 16 ? lanes.low_subtracts : lanes.high_subtracts;
    int32_t left = lane(n, at, width, is_signed), right = lane(m, at, width, is_signed);
    int32_t sum = subtract ? left - right : left + right;
    if (sum >= (is_signed || subtract ? 0 : range)) {
      ge |= (width == 8 ? 1u : 3u) << at / 8;
    }
    if (kind == SATURATED) {
      sum = clamped(sum, lowest, lowest + range - 1);
    } else if (kind == HALVED) {
      sum >>= 1;
    }
    result |= ((uint32_t)sum & (uint32_t)(range - 1)) << at;
  }
  D = result;
  if (kind == MODULO) {
    core->ge = ge;
  }
}

#define DEFINE_PARALLEL(letters, is_signed, kind)                                                       \
  COMPUTATION(letters##add8, parallel(core, insn, (Lanes){8, false, false, false}, is_signed, kind))    \
  COMPUTATION(letters##add16, parallel(core, insn, (Lanes){16, false, false, false}, is_signed, kind))  \
  COMPUTATION(letters##asx, parallel(core, insn, (Lanes){16, true, false, true}, is_signed, kind))      \
  COMPUTATION(letters##sub8, parallel(core, insn, (Lanes){8, true, true, false}, is_signed, kind))      \
  COMPUTATION(letters##sub16, parallel(core, insn, (Lanes){16, true, true, false}, is_signed, kind))    \
  COMPUTATION(letters##sax, parallel(core, insn, (Lanes){16, false, true, true}, is_signed, kind))
DEFINE_PARALLEL(s, true, MODULO)
DEFINE_PARALLEL(q, true, SATURATED)
DEFINE_PARALLEL(sh, true, HALVED)
DEFINE_PARALLEL(u, false, MODULO)
DEFINE_PARALLEL(uq, false, SATURATED)
DEFINE_PARALLEL(uh, false, HALVED)

/* Indices: bits 6:4 of the second and of the first half-word (A5.3.13, A5.3.14). */
#define ROW(letters)                                   \
  {letters##add8, letters##add16, letters##asx, NULL,  \
   letters##sub8, letters##sub16, letters##sax, NULL}
static const Operation PARALLEL[8][8] = {ROW(s), ROW(q), ROW(sh), {0}, ROW(u), ROW(uq), ROW(uh), {0}};

/* -- saturating arithmetic, bits and bytes (A5.3.15) ---------------------------------------------------- */

static int32_t saturated(Core *core, int64_t value) {
  if (value == (int32_t)value) {
    return (int32_t)value;
  }
  core->q = 1;
  return value < 0 ? INT32_MIN : INT32_MAX;
}
static int64_t as_signed(uint32_t word) { return (int32_t)word; }

COMPUTATION(qadd, D = (uint32_t)saturated(core, as_signed(M) + as_signed(N)))
COMPUTATION(qsub, D = (uint32_t)saturated(core, as_signed(M) - as_signed(N)))
COMPUTATION(qdadd, D = (uint32_t)saturated(core, as_signed(M) + saturated(core, 2 * as_signed(N))))
COMPUTATION(qdsub, D = (uint32_t)saturated(core, as_signed(M) - saturated(core, 2 * as_signed(N))))

COMPUTATION(rev, D = __builtin_bswap32(M))
COMPUTATION(rev16, D = rotate_right(__builtin_bswap32(M), 16))
COMPUTATION(revsh, D = SXTH(__builtin_bswap16((uint16_t)M)))
OPERATION(rbit) {
  uint32_t word = __builtin_bswap32(M);
  word = (word & 0x0F0F0F0F) << 4 | (word >> 4 & 0x0F0F0F0F);
  word = (word & 0x33333333) << 2 | (word >> 2 & 0x33333333);
  D = (word & 0x55555555) << 1 | (word >> 1 & 0x55555555);
  NEXT;
}
COMPUTATION(clz, D = M ? (uint32_t)__builtin_clz(M) : 32)
OPERATION(sel) {
  uint32_t mask = 0;
  for (unsigned byte = 0; byte < 4; byte++) {
    mask |= core->ge >> byte & 1 ? 0xFFu << 8 * byte : 0;
  }
  D = (N & mask) | (M & ~mask);
  NEXT;
}

/* Indices: bits 5:4 of the first and of the second half-word. */
static const Operation MISCELLANEOUS[4][4] = {
    {qadd, qdadd, qsub, qdsub}, {rev, rev16, rbit, revsh}, {sel}, {clz}};

Operation shift_by_register(enum Shift type, bool set_flags) {
  static const Operation operations[][2] = {{lsl, lsls}, {lsr, lsrs}, {asr, asrs}, {ror, rors}};
  return operations[type][set_flags];
}

Operation reversal(unsigned number) { return MISCELLANEOUS[1][number]; }

static Operation shift_or_extension(uint16_t first, uint16_t second, Insn *insn) {
  static const Operation EXTENSIONS[] = {sxth, uxth, sxtb16, uxtb16, sxtb, uxtb};
  static const Operation ADDED[] = {sxtah, uxtah, sxtab16, uxtab16, sxtab, uxtab};
  unsigned op1 = bits(first, 6, 4);
  if (!(second & 0xF0)) {
    return shift_by_register((enum Shift)(op1 >> 1), op1 & 1);
  }
  if ((second & 0xC0) != 0x80 || op1 > 5) {
    return NULL;
  }
  insn->shift = (uint8_t)(8 * bits(second, 5, 4));
  if (insn->n == 15) {
    insn->n = 0;
    return EXTENSIONS[op1];
  }
  return ADDED[op1];
}

bool decode_dsp(uint16_t first, uint16_t second, Insn *insn) {
  insn->n = first & 0xF;
  insn->a = second >> 12;
  insn->d = bits(second, 11, 8);
  insn->m = second & 0xF;
  if (!can_be_written(insn->d)) {
    return false;
  }
  if (first >> 8 == 0xFB) {
    return decode_multiply(first, second, insn);
  }
  if (insn->a != 15) {
    return false;
  }
  insn->a = 0;
  if (!(first & 0x80)) {
    insn->run = shift_or_extension(first, second, insn);
  } else if (!(second & 0x80)) {
    insn->run = PARALLEL[bits(second, 6, 4)][bits(first, 6, 4)];
  } else {
    insn->run = second & 0x40 || first & 0x40 ? NULL : MISCELLANEOUS[bits(first, 5, 4)][bits(second, 5, 4)];
  }
  return insn->run != NULL;
}
