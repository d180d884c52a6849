/* Division by a number that rarely changes, by a multiplication. The processor's division takes as long as ten other
 * instructions, and times are computed at every access.
 *
 * The reciprocal is (2^64 - 1) / by, rounded down. Its product with a dividend below 2^63 is too small by less than
 * one quotient, so one correction makes it exact (Warren, Hacker's Delight, chapter 10, has better bounds; here one
 * comparison is enough).
 */
#ifndef FCU_DIVISION_H
#define FCU_DIVISION_H

#include <stdint.h>

typedef struct {
  uint64_t by, reciprocal;
} Divisor;

/* by must be above 0. */
static inline Divisor make_divisor(int64_t by) { return (Divisor){(uint64_t)by, UINT64_MAX / (uint64_t)by}; }

/* Return dividend / by, exactly; the dividend must not be negative. */
static inline int64_t fast_divide(int64_t dividend, const Divisor *divisor) {
  uint64_t quotient = (uint64_t)((unsigned __int128)(uint64_t)dividend * divisor->reciprocal >> 64);
  return (int64_t)(quotient + ((uint64_t)dividend - quotient * divisor->by >= divisor->by));
}

#endif
