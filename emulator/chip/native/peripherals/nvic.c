/* States and priorities of exceptions. */
#include "peripherals/nvic.h"

#include <string.h>

#include "fcu.h"
#include "generated/registers_nvic.h"

#define SYSTEM ((uint64_t)0xFFFF)
#define WORDS 3                 /* interrupt bits */
#define IMPLEMENTED 0xF0F0F0F0u /* four bits of priority */

void nvic_reset(Nvic *nvic) {
  memset(nvic, 0, sizeof *nvic);
  nvic->enabled[0] = SYSTEM;
  for (int number = 0; number < 4; number++) {
    nvic->priority[number] = (int16_t)(number - 4);
  }
  nvic->subpriority_bits = 1; /* even PRIGROUP 0 leaves one subpriority bit */
}

int nvic_group_priority(const Nvic *nvic, int priority) {
  return priority < 0 ? priority : priority >> nvic->subpriority_bits << nvic->subpriority_bits;
}

int nvic_highest_pending(const Nvic *nvic) {
  int best = 0, best_priority = THREAD_PRIORITY;
  for (int word = 0; word < 2; word++) {
    for (uint64_t ready = nvic->pending[word] & nvic->enabled[word]; ready; ready &= ready - 1) {
      int number = 64 * word + __builtin_ctzll(ready);
      if (number < EXCEPTIONS && nvic->priority[number] < best_priority) {
        best = number;
        best_priority = nvic->priority[number];
      }
    }
  }
  return best;
}

int nvic_execution_priority(const Nvic *nvic, bool primask, uint32_t basepri, bool faultmask) {
  int level = THREAD_PRIORITY;
  for (int word = 0; word < 2; word++) {
    for (uint64_t active = nvic->active[word]; active; active &= active - 1) {
      int number = 64 * word + __builtin_ctzll(active);
      int group = number < EXCEPTIONS ? nvic_group_priority(nvic, nvic->priority[number]) : THREAD_PRIORITY;
      level = group < level ? group : level;
    }
  }
  basepri &= 0xF0;
  if (basepri && nvic_group_priority(nvic, (int)basepri) < level) {
    level = nvic_group_priority(nvic, (int)basepri);
  }
  if (primask && level > 0) {
    level = 0;
  }
  return faultmask && level > -1 ? -1 : level;
}

int32_t fcu_priority(const Chip *chip, int32_t exception) { return chip->nvic.priority[exception]; }

int32_t fcu_execution_priority(const Chip *chip, int32_t primask, int32_t basepri, int32_t faultmask) {
  return nvic_execution_priority(&chip->nvic, primask, (uint32_t)basepri, faultmask);
}

int32_t fcu_priority_group(const Chip *chip, int32_t priority) { return nvic_group_priority(&chip->nvic, priority); }

static void update_changed(Nvic *nvic) {
  if (nvic_any_ready(nvic)) {
    nvic->changed = 1;
  }
}

static void pend(Nvic *nvic, int word, uint64_t bits) {
  if (nvic->sevonpend && bits & ~nvic->pending[word]) {
    nvic->event_register = 1;
  }
  nvic->pending[word] |= bits;
  update_changed(nvic);
}

void nvic_pend(Nvic *nvic, int number) { pend(nvic, number >> 6, (uint64_t)1 << (number & 63)); }

void nvic_unpend(Nvic *nvic, int number) { nvic->pending[number >> 6] &= ~((uint64_t)1 << (number & 63)); }

void nvic_set_line(Nvic *nvic, int number, bool level) {
  uint64_t bit = (uint64_t)1 << (number & 63), *lines = &nvic->lines[number >> 6];
  bool rises = level && !(*lines & bit);
  *lines = level ? *lines | bit : *lines & ~bit;
  if (rises) {
    nvic_pend(nvic, number);
  }
}

void nvic_activate(Nvic *nvic, int number) {
  uint64_t bit = (uint64_t)1 << (number & 63);
  nvic->pending[number >> 6] &= ~bit;
  nvic->active[number >> 6] |= bit;
}

void nvic_deactivate(Nvic *nvic, int number) {
  uint64_t bit = (uint64_t)1 << (number & 63);
  nvic->active[number >> 6] &= ~bit;
  pend(nvic, number >> 6, nvic->lines[number >> 6] & bit);
}

/* One word of an NVIC register can span both words of a set. */
static uint32_t interrupts(const uint64_t *set, unsigned word) {
  unsigned first = FIRST_INTERRUPT + 32 * word;
  uint64_t low = set[first >> 6] >> (first & 63);
  uint64_t high = (first & 63) > 32 && first < 64 ? set[1] << (64 - (first & 63)) : 0;
  return (uint32_t)(low | high);
}

static void as_set(uint32_t value, unsigned word, uint64_t set[2]) {
  unsigned first = FIRST_INTERRUPT + 32 * word;
  uint64_t bits = word == WORDS - 1 ? value & 0x1FFFFF : value; /* 85 = 64 + 21 */
  set[0] = first < 64 ? bits << first : 0;
  set[1] = first < 64 ? (first > 32 ? bits >> (64 - first) : 0) : bits << (first - 64);
}

bool nvic_has_register(uint32_t offset) {
  bool is_bits = offset >= NVIC_ISERx(0) && offset < NVIC_IABRx(0) + 4 * WORDS && (offset & 0x7F) < 4 * WORDS;
  return offset == ICTR || is_bits || (offset >= NVIC_IPRx(0) && offset < NVIC_IPRx(0) + 88) || offset == STIR;
}

uint32_t nvic_read(const Nvic *nvic, uint32_t offset) {
  unsigned word = (offset & 0x7F) / 4;
  if (offset == STIR) {
    return 0;
  }
  if (offset == ICTR) {
    return WORDS - 1;
  }
  if (offset >= NVIC_IPRx(0)) {
    uint32_t value = 0, first = FIRST_INTERRUPT + offset - NVIC_IPRx(0);
    for (uint32_t n = 0; n < 4 && first + n < EXCEPTIONS; n++) {
      value |= (uint32_t)nvic->priority[first + n] << 8 * n;
    }
    return value;
  }
  if (offset >= NVIC_IABRx(0)) {
    return interrupts(nvic->active, word);
  }
  return interrupts(offset >= NVIC_ISPRx(0) ? nvic->pending : nvic->enabled, word);
}

static void set_priorities(Nvic *nvic, uint32_t first, uint32_t value, uint32_t mask) {
  for (uint32_t byte = 0; byte < 4; byte++) {
    uint32_t number = FIRST_INTERRUPT + first + byte;
    if (mask >> 8 * byte & 0xFF && number < EXCEPTIONS) {
      nvic->priority[number] = (int16_t)((value & IMPLEMENTED) >> 8 * byte & 0xFF);
    }
  }
}

static void set_bits(Nvic *nvic, uint32_t base, unsigned word, uint32_t value) {
  uint64_t chosen[2];
  as_set(value, word, chosen);
  for (int n = 0; n < 2; n++) {
    switch (base) {
    case NVIC_ISERx(0): nvic->enabled[n] |= chosen[n]; break;
    case NVIC_ICERx(0): nvic->enabled[n] &= ~chosen[n]; break;
    case NVIC_ISPRx(0): pend(nvic, n, chosen[n]); break;
    case NVIC_ICPRx(0): nvic->pending[n] &= ~chosen[n] | (nvic->lines[n] & ~nvic->active[n]); break;
    }
  }
}

void nvic_write(Nvic *nvic, uint32_t offset, uint32_t value, uint32_t mask) {
  value &= mask;
  if (offset == STIR) {
    uint32_t number = value & 0x1FF;
    if (number < EXCEPTIONS - FIRST_INTERRUPT) {
      nvic_pend(nvic, FIRST_INTERRUPT + (int)number);
    }
  } else if (offset >= NVIC_IPRx(0)) {
    set_priorities(nvic, offset - NVIC_IPRx(0), value, mask);
  } else if (offset != ICTR) {
    set_bits(nvic, offset & ~0x7Fu, (offset & 0x7F) / 4, value);
  }
  update_changed(nvic);
}
