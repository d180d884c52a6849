/* Priorities (ARMv7-M ARM B1.5.4): cpu/nvic.py in C. */
#include "nvic.h"

int nvic_group(const Nvic *nvic, int priority) {
  return priority < 0 ? priority : priority >> nvic->subpriority_bits << nvic->subpriority_bits;
}

int nvic_most_urgent(const Nvic *nvic) {
  int best = 0, best_priority = LOWEST;
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

int nvic_level(const Nvic *nvic, bool primask, uint32_t basepri, bool faultmask) {
  int level = LOWEST;
  for (int word = 0; word < 2; word++) {
    for (uint64_t active = nvic->active[word]; active; active &= active - 1) {
      int number = 64 * word + __builtin_ctzll(active);
      int group = number < EXCEPTIONS ? nvic_group(nvic, nvic->priority[number]) : LOWEST;
      level = group < level ? group : level;
    }
  }
  basepri &= 0xF0;
  if (basepri && nvic_group(nvic, (int)basepri) < level) {
    level = nvic_group(nvic, (int)basepri);
  }
  if (primask && level > 0) {
    level = 0;
  }
  return faultmask && level > -1 ? -1 : level;
}

void nvic_activate(Nvic *nvic, int number) {
  uint64_t bit = (uint64_t)1 << (number & 63);
  nvic->pending[number >> 6] &= ~bit;
  nvic->active[number >> 6] |= bit;
}

static void look(Nvic *nvic) {
  if (nvic_any_ready(nvic)) {
    nvic->changed = 1;
  }
}

static void pend(Nvic *nvic, int word, uint64_t bits) {
  if (nvic->event_on_pending && bits & ~nvic->pending[word]) {
    nvic->event = 1;
  }
  nvic->pending[word] |= bits;
  look(nvic);
}

void nvic_pend(Nvic *nvic, int number) { pend(nvic, number >> 6, (uint64_t)1 << (number & 63)); }

void nvic_set_line(Nvic *nvic, int number, bool level) {
  uint64_t bit = (uint64_t)1 << (number & 63), *lines = &nvic->lines[number >> 6];
  bool rises = level && !(*lines & bit);
  *lines = level ? *lines | bit : *lines & ~bit;
  if (rises) {
    nvic_pend(nvic, number);
  }
}

/* A line still active makes its interrupt pending again. */
void nvic_deactivate(Nvic *nvic, int number) {
  uint64_t bit = (uint64_t)1 << (number & 63);
  nvic->active[number >> 6] &= ~bit;
  pend(nvic, number >> 6, nvic->lines[number >> 6] & bit);
}
