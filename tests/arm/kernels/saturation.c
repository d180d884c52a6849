/* SSAT and USAT, whose width and shift stand in the instruction, with Q (ARMv7-M ARM A5.3.11). */
#include "kernel.h"

#define RUNS 60
#define Q 0x08000000u

#define SATURATE(text)                                                                                    \
  {                                                                                                       \
    uint32_t a = word(), result, flags;                                                                   \
    __asm volatile("msr apsr_nzcvq, %3\n\t" text "\n\tmrs %1, apsr"                                       \
                   : "=&r"(result), "=&r"(flags)                                                          \
                   : "r"(a), "r"(0)                                                                       \
                   : "cc");                                                                               \
    add(result);                                                                                          \
    add(flags & Q);                                                                                       \
  }
#define AT_EACH_SHIFT(instruction, width)                                                                 \
  SATURATE(instruction " %0, #" #width ", %2")                                                            \
  SATURATE(instruction " %0, #" #width ", %2, lsl #1")                                                    \
  SATURATE(instruction " %0, #" #width ", %2, lsl #31")                                                   \
  SATURATE(instruction " %0, #" #width ", %2, asr #1")                                                    \
  SATURATE(instruction " %0, #" #width ", %2, asr #13")                                                   \
  SATURATE(instruction " %0, #" #width ", %2, asr #31")

static void run_ssat(void) {
  for (int n = 0; n < RUNS; n++) {
    AT_EACH_SHIFT("ssat", 1)
    AT_EACH_SHIFT("ssat", 2)
    AT_EACH_SHIFT("ssat", 8)
    AT_EACH_SHIFT("ssat", 15)
    AT_EACH_SHIFT("ssat", 16)
    AT_EACH_SHIFT("ssat", 31)
    AT_EACH_SHIFT("ssat", 32)
  }
}

static void run_usat(void) {
  for (int n = 0; n < RUNS; n++) {
    AT_EACH_SHIFT("usat", 0)
    AT_EACH_SHIFT("usat", 1)
    AT_EACH_SHIFT("usat", 8)
    AT_EACH_SHIFT("usat", 16)
    AT_EACH_SHIFT("usat", 30)
    AT_EACH_SHIFT("usat", 31)
  }
}

static void run_halves(void) {
  for (int n = 0; n < RUNS; n++) {
    SATURATE("ssat16 %0, #1, %2")
    SATURATE("ssat16 %0, #5, %2")
    SATURATE("ssat16 %0, #16, %2")
    SATURATE("usat16 %0, #0, %2")
    SATURATE("usat16 %0, #7, %2")
    SATURATE("usat16 %0, #15, %2")
  }
}

const Kernel saturation_kernels[] = {{"ssat", run_ssat}, {"usat", run_usat}, {"sat16", run_halves}, {NULL, NULL}};
