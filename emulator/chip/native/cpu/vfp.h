/* FPv4-SP: single precision (ARMv7-M ARM A2.5).
 *
 * Values are bits in core->s[]. The host's arithmetic is used if its result is certain to be the chip's (vfp_data.c).
 * Otherwise integer arithmetic is used (vfp_exact.c). The host must round to nearest, and the compiler must
 * not fuse operations (-ffp-contract=off).
 */
#ifndef FCU_VFP_H
#define FCU_VFP_H

#include <string.h>

#include "cpu/access.h"

/* FPSCR (A2.5.3). */
#define FPSCR_IOC (1u << 0)
#define FPSCR_DZC (1u << 1)
#define FPSCR_OFC (1u << 2)
#define FPSCR_UFC (1u << 3)
#define FPSCR_IXC (1u << 4)
#define FPSCR_IDC (1u << 7)
#define FPSCR_RMODE (3u << 22)
#define FPSCR_FZ (1u << 24)
#define FPSCR_DN (1u << 25)
#define FPSCR_AHP (1u << 26)
#define FPSCR_NZCV (15u << 28)

enum Rounding { TO_NEAREST, UPWARD, DOWNWARD, TOWARD_ZERO };

static inline enum Rounding rounding_mode(const Core *core) { return core->fpscr >> 22 & 3; }

#define SIGN 0x80000000u
#define INFINITE 0x7F800000u
#define DEFAULT_NAN 0x7FC00000u
#define QUIET 0x00400000u

static inline uint32_t negated(uint32_t value) { return value ^ SIGN; }
static inline bool is_nan(uint32_t value) { return (value & ~SIGN) > INFINITE; }
static inline bool is_signalling(uint32_t value) { return is_nan(value) && !(value & QUIET); }
static inline bool is_infinite(uint32_t value) { return (value & ~SIGN) == INFINITE; }

static inline float to_float(uint32_t value) {
  float result;
  memcpy(&result, &value, sizeof result);
  return result;
}
static inline uint32_t from_float(float value) {
  uint32_t result;
  memcpy(&result, &value, sizeof result);
  return result;
}

/* ExecuteFPCheck(). A new context begins with FPSCR = 0, the reset value of FPDSCR, even if FPDSCR has
 * changed. */
static inline void use_floating_point(Core *core) {
  if (UNLIKELY((core->control & FLOATING_CONTEXT) != FLOATING_CONTEXT)) {
    core->control |= FLOATING_CONTEXT;
    core->fpscr = 0;
  }
}

/* -- vfp_exact.c: pseudocode of A2.5.4, all operands and modes ---------------------------------------- */

uint32_t exact_add(Core *core, uint32_t left, uint32_t right);
uint32_t exact_multiply(Core *core, uint32_t left, uint32_t right);
uint32_t exact_divide(Core *core, uint32_t left, uint32_t right);
uint32_t exact_square_root(Core *core, uint32_t value);
/* addend + left * right, with a single rounding. */
uint32_t exact_multiply_add(Core *core, uint32_t addend, uint32_t left, uint32_t right);

/* (-1)^sign * significand * 2^exponent; if significand has more than 32 bits, its lowest bit is sticky. */
typedef struct {
  bool sign;
  int exponent;
  uint64_t significand;
} Number;

typedef struct {
  int fraction_bits, highest_exponent; /* biased */
} Format;
extern const Format SINGLE, HALF, ALTERNATIVE_HALF;

/* Unpack a finite value. If FPSCR.FZ is set, a denormal becomes 0. */
Number unpacked(Core *core, uint32_t value);
/* FPRound, with flags. */
uint32_t rounded(Core *core, Number number, Format format, enum Rounding mode);
/* FPProcessNaN. */
uint32_t quieted(Core *core, uint32_t nan);

bool decode_vfp_data(uint16_t first, uint16_t second, Insn *insn);
bool decode_vfp_conversion(uint16_t first, uint16_t second, Insn *insn);
bool decode_vfp_memory(uint32_t address, uint16_t first, uint16_t second, Insn *insn);
bool decode_vfp_move(uint16_t first, uint16_t second, Insn *insn);

static inline uint8_t single(unsigned four, unsigned one) { return (uint8_t)((four & 15) << 1 | (one & 1)); }

#endif
