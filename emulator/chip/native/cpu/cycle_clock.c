/* Virtual time from retired instructions; cycle_clock.h explains it. */
#include "cpu/cycle_clock.h"

#include "peripherals/peripheral.h"

typedef __int128 Wide;

/* Set num / den in lowest terms, so that products fit into 64 bits. extra must be 0. */
static void set_rate(CycleClock *cycle_clock, int64_t hclk_hz) {
  int64_t num = cycle_clock->cycles_num * PS_PER_S, cycle = cycle_clock->cycles_den * PS_PER_S;
  int64_t den = cycle_clock->cycles_den * (hclk_hz > 0 ? hclk_hz : 1);
  int64_t common = gcd(gcd(num, cycle), den);
  cycle_clock->num = num / common;
  cycle_clock->den = den / common;
  cycle_clock->by_den = make_divisor(cycle_clock->den);
  cycle_clock->extra_per_cycle = cycle / common;
  cycle_clock->limit = (INT64_MAX - cycle_clock->den) / cycle_clock->num;
}

void cycle_clock_create(CycleClock *cycle_clock, int64_t cycles_num, int64_t cycles_den, int64_t hclk_hz) {
  *cycle_clock = (CycleClock){.cycles_num = cycles_num, .cycles_den = cycles_den};
  set_rate(cycle_clock, hclk_hz);
}

int64_t cycle_clock_wide_ps(const CycleClock *cycle_clock, int64_t count) {
  Wide numerator = (Wide)count * cycle_clock->num + cycle_clock->extra, quotient = numerator / cycle_clock->den;
  return cycle_clock->origin_ps + (int64_t)(quotient - (numerator % cycle_clock->den < 0));
}

int64_t cycle_clock_count_at(const CycleClock *cycle_clock, int64_t at_ps) {
  if (at_ps >= NEVER_PS) {
    return NEVER_PS;
  }
  int64_t after_ps = at_ps - cycle_clock->origin_ps, product;
  if (after_ps >= 0 && !__builtin_mul_overflow(after_ps, cycle_clock->den, &product) && product >= cycle_clock->extra) {
    product -= cycle_clock->extra;
    return product / cycle_clock->num + (product % cycle_clock->num > 0);
  }
  Wide wanted = (Wide)(at_ps - cycle_clock->origin_ps) * cycle_clock->den - cycle_clock->extra;
  Wide quotient = wanted / cycle_clock->num;
  return (int64_t)(quotient + (wanted % cycle_clock->num > 0));
}

void cycle_clock_add_cycles(CycleClock *cycle_clock, int cycles) {
  Wide extra = cycle_clock->extra + (Wide)cycles * cycle_clock->extra_per_cycle;
  cycle_clock->origin_ps += (int64_t)(extra / cycle_clock->den);
  cycle_clock->extra = (int64_t)(extra % cycle_clock->den);
}

void cycle_clock_move_origin(CycleClock *cycle_clock) {
  if (cycle_clock->count >= cycle_clock->limit / 2) {
    Wide passed = (Wide)cycle_clock->count * cycle_clock->num + cycle_clock->extra;
    cycle_clock->origin_ps += (int64_t)(passed / cycle_clock->den);
    cycle_clock->extra = (int64_t)(passed % cycle_clock->den);
    cycle_clock->retired_before += cycle_clock->count;
    cycle_clock->count = 0;
  }
}

static void restart(CycleClock *cycle_clock, int64_t at_ps, int64_t running) {
  cycle_clock->retired_before += cycle_clock->count + running;
  cycle_clock->origin_ps = at_ps;
  cycle_clock->extra = 0;
  cycle_clock->count = -running;
}

void cycle_clock_sleep_until(CycleClock *cycle_clock, int64_t at_ps) { restart(cycle_clock, at_ps, 0); }

void cycle_clock_set_rate(CycleClock *cycle_clock, int64_t hclk_hz, int64_t at_ps, int64_t running) {
  restart(cycle_clock, at_ps, running);
  set_rate(cycle_clock, hclk_hz);
}
