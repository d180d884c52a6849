/* Conversions between single precision and integers, fixed point and half precision, and moves (ARMv7-M ARM
 * A6.4, A6.6).
 */
#include "floating.h"

#define RUNS 1200
#define AHP 0x04000000u

#define CONVERT(name, text, operand, more)                                                                \
  static void run_##name(void) {                                                                          \
    for (unsigned n = 0; n < RUNS; n++) {                                                                 \
      uint32_t a = operand, d = any(), fpscr = mode(n) | (more);                                          \
      __asm volatile("vmsr fpscr, %1\n\tvmov s0, %0\n\tvmov s1, %2\n\t" text                              \
                     "\n\tvmov %0, s0\n\tvmrs %1, fpscr"                                                  \
                     : "+r"(d), "+r"(fpscr)                                                               \
                     : "r"(a)                                                                             \
                     : "s0", "s1");                                                                       \
      add(d);                                                                                             \
      add(fpscr);                                                                                         \
    }                                                                                                     \
    plain();                                                                                              \
  }
/* Fixed point is in the register that it is made from. */
#define TO_FIXED(name, type, bits)                                                                        \
  CONVERT(name, "vmov.f32 s0, s1\n\tvcvt." type ".f32 s0, s0, #" #bits, single(), 0)

CONVERT(to_signed, "vcvt.s32.f32 s0, s1", single(), 0)
CONVERT(to_unsigned, "vcvt.u32.f32 s0, s1", single(), 0)
CONVERT(to_signed_as_fpscr, "vcvtr.s32.f32 s0, s1", single(), 0)
CONVERT(to_unsigned_as_fpscr, "vcvtr.u32.f32 s0, s1", single(), 0)
CONVERT(from_signed, "vcvt.f32.s32 s0, s1", word(), 0)
CONVERT(from_unsigned, "vcvt.f32.u32 s0, s1", word(), 0)
TO_FIXED(to_s16, "s16", 9)
TO_FIXED(to_u16, "u16", 16)
TO_FIXED(to_s32, "s32", 1)
TO_FIXED(to_u32, "u32", 30)
CONVERT(to_bottom_half, "vcvtb.f16.f32 s0, s1", single(), 0)
CONVERT(to_top_half, "vcvtt.f16.f32 s0, s1", single(), 0)
CONVERT(to_alternative_half, "vcvtb.f16.f32 s0, s1", single(), AHP)
CONVERT(from_bottom_half, "vcvtb.f32.f16 s0, s1", any(), 0)
CONVERT(from_top_half, "vcvtt.f32.f16 s0, s1", any(), 0)
CONVERT(from_alternative_half, "vcvtt.f32.f16 s0, s1", any(), AHP)

/* From fixed point it is rounded to nearest whatever FPSCR says; only that mode is compared. */
#define FROM_FIXED_POINT(name, type, bits)                                                                \
  static void run_##name(void) {                                                                          \
    for (unsigned n = 0; n < RUNS; n++) {                                                                 \
      uint32_t d = word(), fpscr = (n & 3) << 24;                                                         \
      __asm volatile("vmsr fpscr, %1\n\tvmov s0, %0\n\tvcvt.f32." type " s0, s0, #" #bits                 \
                     "\n\tvmov %0, s0\n\tvmrs %1, fpscr"                                                  \
                     : "+r"(d), "+r"(fpscr)                                                               \
                     :                                                                                    \
                     : "s0");                                                                             \
      add(d);                                                                                             \
      add(fpscr);                                                                                         \
    }                                                                                                     \
    plain();                                                                                              \
  }
FROM_FIXED_POINT(from_s16, "s16", 4)
FROM_FIXED_POINT(from_u16, "u16", 15)
FROM_FIXED_POINT(from_s32, "s32", 31)
FROM_FIXED_POINT(from_u32, "u32", 2)

/* Between core registers, single and double registers, and memory. */
static void run_moves(void) {
  static uint32_t memory[16];
  for (unsigned n = 0; n < RUNS; n++) {
    uint32_t a = any(), b = any(), c = 0, d = 0, *at = memory + n % 4;
    __asm volatile("vmov s0, s1, %2, %3\n\tvmov d1, %3, %2\n\tvmov s2, %2\n\tvmov.f32 s4, #-0.4375\n\t"
                   "vmov.f32 s5, s3\n\tvstr s4, [%4]\n\tvstr d1, [%4, #8]\n\tvldr s6, [%4, #12]\n\t"
                   "vmov %0, %1, d0\n\tvadd.f32 s7, s4, s4\n\tvstmia %4!, {s4-s7}\n\tvpush {d0-d3}\n\t"
                   "vldmdb %4!, {s1-s3}\n\tvpop {d2-d3}\n\tvstm %4, {d0-d2}\n\tadd sp, #16\n\tvmov %1, s7"
                   : "+r"(c), "+r"(d), "+r"(a), "+r"(b), "+r"(at)
                   :
                   : "s0", "s1", "s2", "s3", "s4", "s5", "s6", "s7", "memory");
    add(c);
    add(d);
    add((uint32_t)(at - memory));
    add_bytes(memory, sizeof memory);
  }
}

const Kernel convert_kernels[] = {
    {"to-signed", run_to_signed},
    {"to-unsigned", run_to_unsigned},
    {"to-signed-as-fpscr", run_to_signed_as_fpscr},
    {"to-unsigned-as-fpscr", run_to_unsigned_as_fpscr},
    {"from-signed", run_from_signed},
    {"from-unsigned", run_from_unsigned},
    {"to-s16", run_to_s16},
    {"to-u16", run_to_u16},
    {"to-s32", run_to_s32},
    {"to-u32", run_to_u32},
    {"to-bottom-half", run_to_bottom_half},
    {"to-top-half", run_to_top_half},
    {"to-alternative-half", run_to_alternative_half},
    {"from-bottom-half", run_from_bottom_half},
    {"from-top-half", run_from_top_half},
    {"from-alternative-half", run_from_alternative_half},
    {"from-s16", run_from_s16},
    {"from-u16", run_from_u16},
    {"from-s32", run_from_s32},
    {"from-u32", run_from_u32},
    {"float-moves", run_moves},
    {NULL, NULL},
};
