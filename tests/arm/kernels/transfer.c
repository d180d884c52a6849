/* Loads and stores of several registers, with index and write-back, and exclusive ones (ARMv7-M ARM A5.3.5 to
 * A5.3.10).
 */
#include "kernel.h"

static uint32_t memory[32];

static void fill(void) {
  for (size_t n = 0; n < LENGTH(memory); n++) {
    memory[n] = any();
  }
}

static void run_several(void) {
  for (int n = 0; n < 200; n++) {
    uint32_t *at = memory + 12;
    fill();
    __asm volatile("ldmia %0!, {r1, r2, r3, r4, r5}\n\tstmdb %0!, {r5, r6}\n\tldmdb %0, {r1, r6, r8, r9}\n\t"
                   "stmia %0, {r1, r2, r8}\n\tadd %0, #20\n\tstmia %0!, {r3, r4, r9}\n\tldmdb %0!, {r2, r3}\n\t"
                   "push {r1, r2, r3, r9}\n\tldr r4, [sp, #8]\n\tpop {r5, r6}\n\tpop {r8, r9}\n\t"
                   "strd r4, r5, [%0, #16]\n\tldrd r1, r2, [%0, #-8]!\n\tstrd r6, r8, [%0], #-12\n\t"
                   "ldrd r3, r4, [%0, #24]\n\tstmia %0, {r1, r2, r3, r4, r9}"
                   : "+r"(at)
                   :
                   : "r1", "r2", "r3", "r4", "r5", "r6", "r8", "r9", "memory");
    add((uint32_t)(at - memory));
    add_bytes(memory, sizeof memory);
  }
}

static void run_indexed(void) {
  for (int n = 0; n < 200; n++) {
    uint32_t *at = memory + 8, index = any() & 7, a, b, c, d;
    fill();
    __asm volatile("ldr %1, [%0, %5, lsl #2]\n\tldrb %2, [%0, %5]\n\tldrsh %3, [%0, %5, lsl #1]\n\t"
                   "ldr %4, [%0, #12]!\n\tstr %1, [%0, #-4]!\n\tstrh %4, [%0], #8\n\tstrb %3, [%0, %5]\n\t"
                   "ldrsb %3, [%0, #-3]\n\tldrt %2, [%0, #4]\n\tstr %2, [%0], #-24\n\tstr %4, [%0, %5, lsl #2]"
                   : "+r"(at), "=&r"(a), "=&r"(b), "=&r"(c), "=&r"(d)
                   : "r"(index)
                   : "memory");
    add(a);
    add(b);
    add(c);
    add(d);
    add((uint32_t)(at - memory));
    add_bytes(memory, sizeof memory);
  }
}

static void run_exclusive(void) {
  for (int n = 0; n < 300; n++) {
    uint32_t *at = memory + (any() & 15), value = any(), old, first, second, third;
    fill();
    __asm volatile("ldrex %0, [%4]\n\tadd %0, %5\n\tstrex %1, %0, [%4]\n\tstrex %2, %5, [%4]\n\t"
                   "ldrexb %0, [%4]\n\tclrex\n\tstrexb %3, %5, [%4]"
                   : "=&r"(old), "=&r"(first), "=&r"(second), "=&r"(third)
                   : "r"(at), "r"(value)
                   : "memory");
    add(old);
    add(first | second << 1 | third << 2);
    __asm volatile("ldrexh %0, [%3]\n\tstrexh %1, %4, [%3]\n\tldrexb %0, [%3]\n\tstrexb %2, %4, [%3]"
                   : "=&r"(old), "=&r"(first), "=&r"(second)
                   : "r"(at), "r"(value)
                   : "memory");
    add(old);
    add(first | second << 1);
    add_bytes(memory, sizeof memory);
  }
}

/* The compiler's loops of LDREX and STREX. */
static void run_atomic(void) {
  static uint32_t total;
  static uint16_t half;
  static uint8_t byte;
  for (int n = 0; n < 200; n++) {
    uint32_t value = any(), expected = n % 3 ? total : value;
    add(__atomic_fetch_add(&total, value, __ATOMIC_SEQ_CST));
    add(__atomic_fetch_xor(&half, (uint16_t)value, __ATOMIC_ACQUIRE));
    add(__atomic_exchange_n(&byte, (uint8_t)value, __ATOMIC_RELEASE));
    add((uint32_t)__atomic_compare_exchange_n(&total, &expected, value, 0, __ATOMIC_SEQ_CST, __ATOMIC_RELAXED));
    add(expected);
  }
}

const Kernel transfer_kernels[] = {
    {"several", run_several}, {"indexed", run_indexed}, {"exclusive", run_exclusive}, {"atomic", run_atomic},
    {NULL, NULL},
};
