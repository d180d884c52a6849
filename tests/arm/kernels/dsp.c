/* Parallel additions and subtractions with APSR.GE and SEL, and what packs, extends, reverses and counts
 * (ARMv7-M ARM A5.3.11 to A5.3.15).
 */
#include "kernel.h"

#define RUNS 300

/* GE and Q as the instruction leaves them; N, Z, C and V are not its own. */
#define GE_AND_Q 0x080F0000u

/* Result, what SEL chooses by GE, and the flags; they are 0 before. */
#define PARALLEL(instruction)                                                                             \
  static void run_##instruction(void) {                                                                   \
    for (int n = 0; n < RUNS; n++) {                                                                      \
      uint32_t a = word(), b = word(), c = any(), result, selected, flags;                                \
      __asm volatile("msr apsr_nzcvqg, %6\n\t" #instruction " %0, %3, %4\n\t"                            \
                     "sel %1, %5, %3\n\tmrs %2, apsr"                                                     \
                     : "=&r"(result), "=&r"(selected), "=&r"(flags)                                       \
                     : "r"(a), "r"(b), "r"(c), "r"(0)                                                     \
                     : "cc");                                                                             \
      add(result);                                                                                        \
      add(selected);                                                                                      \
      add(flags & GE_AND_Q);                                                                              \
    }                                                                                                     \
  }
#define OF_A_KIND(kind)                                                                                   \
  PARALLEL(kind##add8)                                                                                    \
  PARALLEL(kind##add16)                                                                                   \
  PARALLEL(kind##asx)                                                                                     \
  PARALLEL(kind##sub8)                                                                                    \
  PARALLEL(kind##sub16)                                                                                   \
  PARALLEL(kind##sax)
OF_A_KIND(s)
OF_A_KIND(q)
OF_A_KIND(sh)
OF_A_KIND(u)
OF_A_KIND(uq)
OF_A_KIND(uh)
PARALLEL(usad8)

#define ENTRIES_OF_A_KIND(kind)                                                                           \
  {#kind "add8", run_##kind##add8}, {#kind "add16", run_##kind##add16}, {#kind "asx", run_##kind##asx},   \
      {#kind "sub8", run_##kind##sub8}, {#kind "sub16", run_##kind##sub16}, {#kind "sax", run_##kind##sax}

/* Three operands to one; written once for each variant. */
#define ONE(text, a, b)                                                                                   \
  {                                                                                                       \
    uint32_t result;                                                                                      \
    __asm volatile(text : "=r"(result) : "r"(a), "r"(b));                                                 \
    add(result);                                                                                          \
  }

static void run_extend(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), b = word();
    ONE("sxtb %0, %1, ror #8", a, b)
    ONE("sxth %0, %1, ror #24", a, b)
    ONE("uxtb %0, %1, ror #16", a, b)
    ONE("uxth %0, %1", a, b)
    ONE("sxtb16 %0, %1", a, b)
    ONE("sxtb16 %0, %1, ror #8", a, b)
    ONE("uxtb16 %0, %1, ror #16", a, b)
    ONE("sxtab %0, %1, %2", a, b)
    ONE("sxtab %0, %1, %2, ror #24", a, b)
    ONE("sxtah %0, %1, %2, ror #8", a, b)
    ONE("sxtab16 %0, %1, %2, ror #8", a, b)
    ONE("uxtab %0, %1, %2, ror #16", a, b)
    ONE("uxtah %0, %1, %2", a, b)
    ONE("uxtab16 %0, %1, %2, ror #24", a, b)
  }
}

static void run_pack(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), b = word();
    ONE("pkhbt %0, %1, %2", a, b)
    ONE("pkhbt %0, %1, %2, lsl #5", a, b)
    ONE("pkhbt %0, %1, %2, lsl #31", a, b)
    ONE("pkhtb %0, %1, %2, asr #1", a, b)
    ONE("pkhtb %0, %1, %2, asr #16", a, b)
    ONE("pkhtb %0, %1, %2, asr #32", a, b)
  }
}

static void run_reverse(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word();
    ONE("rev %0, %1", a, 0)
    ONE("rev16 %0, %1", a, 0)
    ONE("revsh %0, %1", a, 0)
    ONE("rbit %0, %1", a, 0)
    ONE("clz %0, %1", a, 0)
  }
}

static void run_bit_fields(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), inserted = word(), cleared = any();
    ONE("ubfx %0, %1, #3, #17", a, 0)
    ONE("ubfx %0, %1, #0, #32", a, 0)
    ONE("sbfx %0, %1, #5, #1", a, 0)
    ONE("sbfx %0, %1, #31, #1", a, 0)
    ONE("sbfx %0, %1, #12, #20", a, 0)
    __asm volatile("bfi %0, %2, #7, #9\n\tbfi %0, %2, #31, #1\n\tbfc %1, #4, #11\n\tbfc %1, #31, #1"
                   : "+r"(inserted), "+r"(cleared)
                   : "r"(a));
    add(inserted);
    add(cleared);
  }
}

/* Each shift by a register's lowest byte, 0 to 255, with the carry that it leaves (A7.4.2). */
#define SHIFT(instruction)                                                                                \
  static void run_##instruction(void) {                                                                   \
    for (uint32_t by = 0; by < 512; by++) {                                                               \
      for (uint32_t before = 0; before < 2; before++) {                                                   \
        uint32_t result = word(), flags;                                                                  \
        __asm volatile("msr apsr_nzcvq, %3\n\t" #instruction " %0, %0, %2\n\tmrs %1, apsr"                \
                       : "+r"(result), "=&r"(flags)                                                       \
                       : "r"(by), "r"(before << 29)                                                       \
                       : "cc");                                                                           \
        add(result);                                                                                      \
        add(flags & 0xF0000000u);                                                                         \
      }                                                                                                   \
    }                                                                                                     \
  }
SHIFT(lsls)
SHIFT(lsrs)
SHIFT(asrs)
SHIFT(rors)

/* Arithmetic with flags, the carry before included; operands shifted. */
#define FLAGS(text)                                                                                       \
  {                                                                                                       \
    uint32_t result = c, flags;                                                                           \
    __asm volatile("msr apsr_nzcvq, %4\n\t" text "\n\tmrs %1, apsr"                                       \
                   : "+r"(result), "=&r"(flags)                                                           \
                   : "r"(a), "r"(b), "r"(before)                                                          \
                   : "cc");                                                                               \
    add(result);                                                                                          \
    add(flags & 0xF8000000u);                                                                             \
  }

static void run_flags(void) {
  for (int n = 0; n < RUNS; n++) {
    uint32_t a = word(), b = word(), c = any(), before = any() & 0xF0000000u;
    FLAGS("adds %0, %2, %3")
    FLAGS("adcs %0, %2, %3")
    FLAGS("subs %0, %2, %3")
    FLAGS("sbcs %0, %2, %3")
    FLAGS("rsbs %0, %2, %3")
    FLAGS("rsbs %0, %2, #0")
    FLAGS("cmp %2, %3")
    FLAGS("cmn %2, %3")
    FLAGS("adcs %0, %2, %3, lsl #3")
    FLAGS("sbcs %0, %2, %3, ror #7")
    FLAGS("adds %0, %2, %3, rrx")
    FLAGS("subs %0, %2, %3, asr #32")
    FLAGS("ands %0, %2, %3, lsr #1")
    FLAGS("bics %0, %2, %3, lsl #31")
    FLAGS("orrs %0, %2, %3, asr #5")
    FLAGS("orns %0, %2, %3, ror #16")
    FLAGS("eors %0, %2, %3, lsr #32")
    FLAGS("tst %2, %3, rrx")
    FLAGS("teq %2, %3, lsl #9")
    FLAGS("mvns %0, %2, asr #11")
    FLAGS("movs %0, %2, rrx")
    FLAGS("ands %0, %2, #0x80000000")
    FLAGS("eors %0, %2, #0x00AB00AB")
    FLAGS("adds %0, %2, #0xFF000000")
    FLAGS("subs %0, %2, #0x3FC")
    FLAGS("addw %0, %2, #4095")
    FLAGS("subw %0, %2, #4095")
    FLAGS("adcs %0, %2, #0xABABABAB")
  }
}

const Kernel dsp_kernels[] = {
    ENTRIES_OF_A_KIND(s),
    ENTRIES_OF_A_KIND(q),
    ENTRIES_OF_A_KIND(sh),
    ENTRIES_OF_A_KIND(u),
    ENTRIES_OF_A_KIND(uq),
    ENTRIES_OF_A_KIND(uh),
    {"usad8", run_usad8},
    {"extend", run_extend},
    {"pack", run_pack},
    {"reverse", run_reverse},
    {"bit-fields", run_bit_fields},
    {"lsl", run_lsls},
    {"lsr", run_lsrs},
    {"asr", run_asrs},
    {"ror", run_rors},
    {"flags", run_flags},
    {NULL, NULL},
};
