/* Virtual time from retired instructions; timeline.h explains it. */
#include "timeline.h"

#include "block.h"

typedef __int128 Wide;

/* Lowest terms, so that products of usual counts fit into 64 bits. extra must be 0. */
static void set_rate(Timeline *timeline, int64_t hclk_hz) {
  int64_t num = timeline->cycles_num * PS_PER_S, cycle = timeline->cycles_den * PS_PER_S;
  int64_t den = timeline->cycles_den * (hclk_hz > 0 ? hclk_hz : 1);
  int64_t common = common_divisor(common_divisor(num, cycle), den);
  timeline->num = num / common;
  timeline->den = den / common;
  timeline->by_den = divisor_of(timeline->den);
  timeline->cycle = cycle / common;
  timeline->limit = (INT64_MAX - timeline->den) / timeline->num;
}

void timeline_create(Timeline *timeline, int64_t cycles_num, int64_t cycles_den, int64_t hclk_hz) {
  *timeline = (Timeline){.cycles_num = cycles_num, .cycles_den = cycles_den};
  set_rate(timeline, hclk_hz);
}

int64_t timeline_wide_ps(const Timeline *timeline, int64_t count) {
  Wide numerator = (Wide)count * timeline->num + timeline->extra, quotient = numerator / timeline->den;
  return timeline->origin_ps + (int64_t)(quotient - (numerator % timeline->den < 0));
}

int64_t timeline_position(const Timeline *timeline, int64_t at_ps) {
  if (at_ps >= NEVER_PS) {
    return NEVER_PS;
  }
  int64_t after_ps = at_ps - timeline->origin_ps, product;
  if (after_ps >= 0 && !__builtin_mul_overflow(after_ps, timeline->den, &product) && product >= timeline->extra) {
    product -= timeline->extra;
    return product / timeline->num + (product % timeline->num > 0);
  }
  Wide wanted = (Wide)(at_ps - timeline->origin_ps) * timeline->den - timeline->extra;
  Wide quotient = wanted / timeline->num;
  return (int64_t)(quotient + (wanted % timeline->num > 0));
}

void timeline_spend(Timeline *timeline, int cycles) {
  Wide extra = timeline->extra + (Wide)cycles * timeline->cycle;
  timeline->origin_ps += (int64_t)(extra / timeline->den);
  timeline->extra = (int64_t)(extra % timeline->den);
}

void timeline_move_origin(Timeline *timeline) {
  if (timeline->count >= timeline->limit / 2) {
    Wide passed = (Wide)timeline->count * timeline->num + timeline->extra;
    timeline->origin_ps += (int64_t)(passed / timeline->den);
    timeline->extra = (int64_t)(passed % timeline->den);
    timeline->before += timeline->count;
    timeline->count = 0;
  }
}

static void restart(Timeline *timeline, int64_t at_ps, int64_t running) {
  timeline->before += timeline->count + running;
  timeline->origin_ps = at_ps;
  timeline->extra = 0;
  timeline->count = -running;
}

void timeline_sleep_until(Timeline *timeline, int64_t at_ps) { restart(timeline, at_ps, 0); }

void timeline_set_rate(Timeline *timeline, int64_t hclk_hz, int64_t at_ps, int64_t running) {
  restart(timeline, at_ps, running);
  set_rate(timeline, hclk_hz);
}
