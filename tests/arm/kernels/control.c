/* Where the program goes: TBB and TBH, sparse choices, function pointers, a machine of bytes. */
#include <setjmp.h>

#include "kernel.h"

/* TBB: few short cases. */
static uint32_t few(uint32_t choice, uint32_t value) {
  switch (choice) {
  case 0: return value + 1;
  case 1: return value ^ 0x55;
  case 2: return value * 3;
  case 3: return value >> 3;
  case 4: return ~value;
  case 5: return value << 7;
  case 6: return value - 100;
  case 7: return value | 0x8001;
  case 9: return value & 0xFFF0;
  default: return 0;
  }
}

/* TBH: cases that are together longer than a byte's offset reaches. */
#define CASE(n) \
  case n: value = (value ^ (n) * 0x01010101u) + (value >> ((n) % 7 + 1)); add(value); break;
#define CASES(n) CASE(n) CASE(n + 1) CASE(n + 2) CASE(n + 3) CASE(n + 4) CASE(n + 5) CASE(n + 6) CASE(n + 7)
static uint32_t many(uint32_t choice, uint32_t value) {
  switch (choice) {
    CASES(0) CASES(8) CASES(16) CASES(24) CASES(32) CASES(40) CASES(48) CASES(56)
  default: value = 0;
  }
  return value;
}

static const char *sparse(uint32_t choice) {
  switch (choice) {
  case 3: return "three";
  case 1000: return "thousand";
  case 65537: return "F4";
  case 0x80000000: return "high";
  case 0xFFFFFFFF: return "all";
  case 77: return "seven";
  default: return choice < 10 ? "small" : "large";
  }
}

static void run_switches(void) {
  static const uint32_t chosen[] = {3, 1000, 65537, 0x80000000, 0xFFFFFFFF, 77, 4, 78};
  for (int n = 0; n < 800; n++) {
    uint32_t value = any();
    add(few(value % 11, value));
    add(many(value % 66, value));
    const char *text = sparse(n % 2 ? value : chosen[value & 7]);
    add((uint32_t)text[0] << 8 | (uint32_t)text[1]);
  }
}

/* Tables in the code, read by the instructions themselves. */
static void run_table_branches(void) {
  for (uint32_t n = 0; n < 64; n++) {
    uint32_t index = n & 3, result;
    __asm volatile("tbb [pc, %1]\n0: .byte (1f-0b)/2, (2f-0b)/2, (3f-0b)/2, (4f-0b)/2\n"
                   "1: mov %0, #11\n\tb 5f\n2: mov %0, #22\n\tb 5f\n3: mov %0, #33\n\tb 5f\n4: mov %0, #44\n5:"
                   : "=&r"(result)
                   : "r"(index));
    add(result);
    __asm volatile("tbh [pc, %1, lsl #1]\n0: .short (1f-0b)/2, (2f-0b)/2, (3f-0b)/2, (4f-0b)/2\n"
                   "1: mov %0, #11\n\tb 5f\n\t.space 600\n2: mov %0, #22\n\tb 5f\n3: mov %0, #33\n\tb 5f\n"
                   "4: mov %0, #44\n5:"
                   : "=&r"(result)
                   : "r"(index));
    add(result);
  }
}

typedef uint32_t Operation(uint32_t, uint32_t);
static uint32_t plus(uint32_t a, uint32_t b) { return a + b; }
static uint32_t minus(uint32_t a, uint32_t b) { return a - b; }
static uint32_t times(uint32_t a, uint32_t b) { return a * b; }
static uint32_t by(uint32_t a, uint32_t b) { return b ? a / b : a; }

static void run_pointers(void) {
  static Operation *const operations[] = {plus, minus, times, by};
  uint32_t value = 1;
  for (int n = 0; n < 2000; n++) {
    uint32_t choice = any();
    value = operations[choice & 3](value, choice >> 7) + 1;
    add(value);
  }
}

/* Ten arguments, of which four are in registers; structures by value. */
typedef struct {
  uint32_t words[6];
  uint8_t byte;
} Parcel;

__attribute__((noinline)) static Parcel pass(Parcel parcel, uint32_t a, uint64_t b, float c, int8_t d, double e) {
  parcel.words[a % 6] += (uint32_t)b ^ (uint32_t)(int32_t)(c * 4);
  parcel.byte = (uint8_t)(parcel.byte + d);
  parcel.words[(a + 1) % 6] ^= (uint32_t)(int32_t)e;
  return parcel;
}

static void run_arguments(void) {
  Parcel parcel = {{0}, 0};
  for (int n = 0; n < 300; n++) {
    uint32_t value = any();
    parcel = pass(parcel, value, any64(), (float)(value & 0xFFFF), (int8_t)value, (double)(value >> 9));
  }
  for (int n = 0; n < 6; n++) {
    add(parcel.words[n]);
  }
  add(parcel.byte);
}

static jmp_buf place;
static void fall(uint32_t depth) {
  if (depth < 99) {
    depth ? fall(depth - 1) : longjmp(place, 7);
  }
  add(depth); /* not reached */
}

static void run_jumps(void) {
  for (volatile uint32_t n = 0; n < 40; n++) {
    int came_by = setjmp(place);
    if (!came_by) {
      fall(n);
    }
    add((uint32_t)came_by);
  }
}

/* An interpreter of a language with eight instructions, which looks for the end of a loop each time. */
static void run_interpreter(void) {
  static const char *const programs[] = {
      "++++++++[>++++++++<-]>+.+.+.",
      "+++++++[>+++++[>++++++>+++<<-]<-]>>.>.",
      "++++[>++++<-]>[<+++++++>-]<[->+>+<<]>[>[->+>+<<]>>[-<<+>>]<<<-]>>.",
      "----[>+<----]>[>+++>+<<-]>+.>-.",
  };
  for (size_t n = 0; n < LENGTH(programs); n++) {
    uint8_t cells[16] = {0};
    uint32_t cell = 0, steps = 0;
    for (const char *at = programs[n]; *at; at++, steps++) {
      int forward = *at == '[' && !cells[cell], back = *at == ']' && cells[cell];
      switch (*at) {
      case '>': cell = (cell + 1) & 15; break;
      case '<': cell = (cell - 1) & 15; break;
      case '+': cells[cell]++; break;
      case '-': cells[cell]--; break;
      case '.': add(cells[cell]); break;
      default: break;
      }
      for (int depth = forward - back; depth;) {
        at += forward - back;
        depth += (*at == '[') - (*at == ']');
      }
    }
    add(steps);
  }
}

const Kernel control_kernels[] = {
    {"switches", run_switches},   {"table-branches", run_table_branches}, {"pointers", run_pointers},
    {"arguments", run_arguments}, {"long-jumps", run_jumps},              {"interpreter", run_interpreter},
    {NULL, NULL},
};
