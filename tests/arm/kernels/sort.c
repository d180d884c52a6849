/* Sorting and recursion. */
#include <stdlib.h>
#include <string.h>

#include "kernel.h"

#define COUNT 400

static uint32_t numbers[COUNT], spare[COUNT];

static void fill(void) {
  for (int n = 0; n < COUNT; n++) {
    numbers[n] = word();
  }
}

static int by_value(const void *left, const void *right) {
  uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
  return (a > b) - (a < b);
}

static int by_low_byte(const void *left, const void *right) {
  return (int)(*(const uint32_t *)left & 0xFF) - (int)(*(const uint32_t *)right & 0xFF);
}

static void run_library(void) {
  fill();
  qsort(numbers, COUNT, sizeof *numbers, by_value);
  add_bytes(numbers, sizeof numbers);
  for (int n = 0; n < 100; n++) {
    uint32_t wanted = n % 2 ? numbers[any() % COUNT] : any();
    uint32_t *found = bsearch(&wanted, numbers, COUNT, sizeof *numbers, by_value);
    add(found ? *found : 0);
  }
}

static void quick(int32_t *first, int32_t *last) {
  while (first < last) {
    int32_t pivot = first[(last - first) / 2], *low = first, *high = last;
    while (low <= high) {
      while (*low < pivot) {
        low++;
      }
      while (*high > pivot) {
        high--;
      }
      if (low <= high) {
        int32_t kept = *low;
        *low++ = *high;
        *high-- = kept;
      }
    }
    quick(first, high);
    first = low;
  }
}

static void run_quick(void) {
  fill();
  quick((int32_t *)numbers, (int32_t *)numbers + COUNT - 1);
  add_bytes(numbers, sizeof numbers);
}

/* Stable, so that equal keys keep their order. */
static void merge(uint32_t *begin, size_t count, int (*compare)(const void *, const void *)) {
  if (count < 2) {
    return;
  }
  size_t half = count / 2, left = 0, right = half, at = 0;
  merge(begin, half, compare);
  merge(begin + half, count - half, compare);
  while (left < half || right < count) {
    int takes_left = right == count || (left < half && compare(begin + left, begin + right) <= 0);
    spare[at++] = begin[takes_left ? left++ : right++];
  }
  memcpy(begin, spare, count * sizeof *begin);
}

static void run_merge(void) {
  fill();
  merge(numbers, COUNT, by_low_byte);
  add_bytes(numbers, sizeof numbers);
}

static void run_heap(void) {
  size_t count = COUNT;
  fill();
  for (size_t begin = COUNT / 2; count > 1;) {
    if (begin) {
      begin--;
    } else {
      uint32_t kept = numbers[--count];
      numbers[count] = numbers[0];
      numbers[0] = kept;
    }
    size_t root = begin, child;
    uint32_t sunk = numbers[root];
    for (; (child = 2 * root + 1) < count; root = child) {
      child += child + 1 < count && numbers[child] < numbers[child + 1];
      if (sunk >= numbers[child]) {
        break;
      }
      numbers[root] = numbers[child];
    }
    numbers[root] = sunk;
  }
  add_bytes(numbers, sizeof numbers);
}

static void run_insertion(void) {
  uint16_t halves[120];
  int8_t bytes[120];
  for (int n = 0; n < 120; n++) {
    halves[n] = (uint16_t)any();
    bytes[n] = (int8_t)any();
  }
  for (int n = 1; n < 120; n++) {
    uint16_t half = halves[n];
    int8_t byte = bytes[n];
    int at = n, place = n;
    for (; at && halves[at - 1] > half; at--) {
      halves[at] = halves[at - 1];
    }
    for (; place && bytes[place - 1] > byte; place--) {
      bytes[place] = bytes[place - 1];
    }
    halves[at] = half;
    bytes[place] = byte;
  }
  add_bytes(halves, sizeof halves);
  add_bytes(bytes, sizeof bytes);
}

static uint32_t ackermann(uint32_t m, uint32_t n) {
  return m == 0 ? n + 1 : ackermann(m - 1, n == 0 ? 1 : ackermann(m, n - 1));
}

static uint32_t fibonacci(uint32_t n) { return n < 2 ? n : fibonacci(n - 1) + fibonacci(n - 2); }

static uint32_t moves(int discs, int from, int to) {
  if (discs == 0) {
    return 0;
  }
  uint32_t before = moves(discs - 1, from, 3 - from - to);
  add((uint32_t)(from << 8 | to));
  return before + 1 + moves(discs - 1, 3 - from - to, to);
}

static int odd(uint32_t n);
static int even(uint32_t n) { return n == 0 || odd(n - 1); }
static int odd(uint32_t n) { return n != 0 && even(n - 1); }

static uint32_t queens(int row, uint32_t columns, uint32_t left, uint32_t right) {
  if (row == 0) {
    return 1;
  }
  uint32_t count = 0;
  for (uint32_t free = ~(columns | left | right) & 0xFF; free; free &= free - 1) {
    uint32_t bit = free & -free;
    count += queens(row - 1, columns | bit, (left | bit) << 1, (right | bit) >> 1);
  }
  return count;
}

static void run_recursion(void) {
  add(ackermann(2, 9));
  add(fibonacci(17));
  add(moves(8, 0, 2));
  add((uint32_t)even(101));
  add(queens(8, 0, 0, 0));
}

const Kernel sort_kernels[] = {
    {"qsort", run_library},     {"quick-sort", run_quick},    {"merge-sort", run_merge}, {"heap-sort", run_heap},
    {"insertion-sort", run_insertion}, {"recursion", run_recursion}, {NULL, NULL},
};
