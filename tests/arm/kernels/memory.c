/* The C library's memory and string functions at every alignment, unaligned accesses and bit-band aliases
 * (ARMv7-M ARM A3.2.1, B3.1; PM0214 section 2.2.5).
 */
#include <string.h>

#include "kernel.h"

#define SIZE 160

static uint8_t from[SIZE], to[SIZE];

static void fill(void) {
  for (int n = 0; n < SIZE; n++) {
    from[n] = (uint8_t)any();
    to[n] = (uint8_t)n;
  }
}

static void run_copy(void) {
  for (size_t n = 0; n < 8 * 8 * 40; n += 1 + (any() & 3)) {
    size_t source = n & 7, target = n >> 3 & 7, size = n >> 6;
    fill();
    memcpy(to + target, from + source, size);
    add_bytes(to, SIZE);
    memmove(to + source, to + target, 100);
    memset(from + target, (int)n, size);
    add_bytes(to, SIZE);
    add((uint32_t)(memcmp(to, from, SIZE) < 0));
  }
}

static void run_strings(void) {
  char text[64], other[64];
  for (int n = 0; n < 300; n++) {
    int begin = n & 7, length = (int)(any() % 40);
    memset(text, 'x', sizeof text);
    for (int at = 0; at < length; at++) {
      text[begin + at] = (char)('a' + any() % 3);
    }
    text[begin + length] = 0;
    strcpy(other + (n >> 3 & 7), text + begin);
    add((uint32_t)strlen(text + begin));
    add((uint32_t)(strcmp(text + begin, "abcab") < 0));
    add((uint32_t)strcmp(text + begin, other + (n >> 3 & 7)));
    const char *found = strchr(text + begin, 'c');
    add(found ? (uint32_t)(found - text) : 99);
    found = strstr(text + begin, "bac");
    add(found ? (uint32_t)(found - text) : 99);
    add((uint32_t)strspn(text + begin, "ab"));
  }
}

static void run_unaligned(void) {
  for (int n = 0; n < 400; n++) {
    uint8_t *at = from + (any() & 63), *place = to + (any() & 63);
    uint32_t a, b, c, d, e, f;
    if (n % 40 == 0) {
      fill();
    }
    __asm volatile("ldr %0, [%6]\n\tldrh %1, [%6, #5]\n\tldrsh %2, [%6, #7]\n\tldr %3, [%6, #9]!\n\t"
                   "ldrh %4, [%6], #3\n\tldrsb %5, [%6]"
                   : "=&r"(a), "=&r"(b), "=&r"(c), "=&r"(d), "=&r"(e), "=&r"(f), "+r"(at)
                   :
                   : "memory");
    __asm volatile("str %1, [%0]\n\tstrh %2, [%0, #6]\n\tstr %3, [%0, #11]!\n\tstrh %4, [%0], #-5\n\tstrb %1, [%0]"
                   : "+r"(place)
                   : "r"(a), "r"(b), "r"(c), "r"(d)
                   : "memory");
    add(a);
    add(b);
    add(c);
    add(d);
    add(e);
    add(f);
    add((uint32_t)(at - from));
    add((uint32_t)(place - to));
    add_bytes(to, SIZE);
  }
}

/* The forms with an index in a register. */
static void run_unaligned_index(void) {
  for (int n = 0; n < 400; n++) {
    uint8_t *base = from + (any() & 31), *place = to + (any() & 31);
    uint32_t index = any() & 15, a, b, c, d;
    if (n % 40 == 0) {
      fill();
    }
    __asm volatile("ldr %0, [%4, %5, lsl #1]\n\tldrh %1, [%4, %5]\n\tldrsh %2, [%4, %5, lsl #3]\n\t"
                   "ldr %3, [%4, %5]\n\tstr %0, [%6, %5]\n\tstrh %2, [%6, %5, lsl #2]\n\t"
                   "str %3, [%6, %5, lsl #3]\n\tstrh %1, [%6, %5]"
                   : "=&r"(a), "=&r"(b), "=&r"(c), "=&r"(d)
                   : "r"(base), "r"(index), "r"(place)
                   : "memory");
    add(a);
    add(b);
    add(c);
    add(d);
    add_bytes(to, SIZE);
  }
}

/* LDRT, STRT and their kin: privileged code may make unprivileged accesses. */
static void run_unprivileged(void) {
  for (int n = 0; n < 400; n++) {
    uint8_t *at = from + (any() & 63), *place = to + (any() & 63);
    uint32_t a, b, c, d, e;
    if (n % 40 == 0) {
      fill();
    }
    __asm volatile("ldrt %0, [%5, #3]\n\tldrht %1, [%5, #6]\n\tldrsht %2, [%5, #1]\n\tldrbt %3, [%5, #2]\n\t"
                   "ldrsbt %4, [%5, #9]\n\tstrt %0, [%6, #7]\n\tstrht %2, [%6, #1]\n\tstrbt %4, [%6, #13]"
                   : "=&r"(a), "=&r"(b), "=&r"(c), "=&r"(d), "=&r"(e)
                   : "r"(at), "r"(place)
                   : "memory");
    add(a);
    add(b);
    add(c);
    add(d);
    add(e);
    add_bytes(to, SIZE);
  }
}

/* Constants are in flash, and at 0 as well. */
static void run_unaligned_flash(void) {
  static const uint8_t constants[80] = "unaligned words and half-words of what is in flash, and its alias at 0, too";
  for (int n = 0; n < 300; n++) {
    const uint8_t *at = constants + (any() & 63);
    uint32_t alias = (uint32_t)at & 0x00FFFFFF, a, b, c;
    __asm volatile("ldr %0, [%3]\n\tldrsh %1, [%3, #3]\n\tldr %2, [%4, #5]"
                   : "=&r"(a), "=&r"(b), "=&r"(c)
                   : "r"(at), "r"(alias)
                   : "memory");
    add(a);
    add(b);
    add(c);
  }
}

struct __attribute__((packed)) Packed {
  uint8_t kind;
  uint32_t value;
  int16_t x, y;
  uint64_t time;
  uint16_t low : 5, middle : 7, high : 4;
  float number;
};

static void run_packed(void) {
  static struct Packed records[12];
  for (int n = 0; n < 200; n++) {
    struct Packed *record = records + any() % LENGTH(records);
    record->kind++;
    record->value ^= any();
    record->x = (int16_t)(record->x * 3 + (int16_t)any());
    record->y = (int16_t)(record->x >> 2);
    record->time += record->value;
    record->low = (uint16_t)(any() & 31);
    record->middle = (uint16_t)(record->middle + 3u) & 0x7F;
    record->high = record->low >> 1;
    record->number += (float)record->y;
    add(record->middle);
  }
  add_bytes(records, sizeof records);
}

/* A word of the alias for each bit of RAM. */
static void run_bit_band(void) {
  static uint32_t words[4];
  volatile uint32_t *alias = (volatile uint32_t *)(0x22000000 + 32 * ((uintptr_t)words - 0x20000000));
  for (int n = 0; n < 300; n++) {
    uint32_t bit = any() & 127, value = any();
    alias[bit] = value;
    ((volatile uint8_t *)alias)[4 * (any() & 127)] = (uint8_t)value;
    add(alias[any() & 127]);
    add_bytes(words, sizeof words);
  }
}

const Kernel memory_kernels[] = {
    {"copy", run_copy},     {"strings", run_strings},   {"unaligned", run_unaligned},
    {"unaligned-index", run_unaligned_index}, {"unprivileged", run_unprivileged},
    {"unaligned-flash", run_unaligned_flash}, {"packed", run_packed}, {"bit-band", run_bit_band}, {NULL, NULL},
};
