/* Division by a number that rarely changes. This method avoids the slow division instruction, because times are
 * computed at every access.
 *
 * The reciprocal is (2^64 - 1) / by, rounded down. If a dividend below 2^63 is multiplied by the reciprocal,
 * the resulting quotient is at most 1 too small. One correction makes the quotient exact (Warren, Hacker's
 * Delight, chapter 10).
 */
#ifndef FCU_DIVISION_H
#define FCU_DIVISION_H

#include <stdint.h>

typedef struct {
  uint64_t by, reciprocal;
} Divisor;

/* `by` must be positive. */
static inline Divisor make_divisor(int64_t by) { return (Divisor){(uint64_t)by, UINT64_MAX / (uint64_t)by}; }

/* `dividend` must not be negative; the result is exact. */
static inline int64_t fast_divide(int64_t dividend, const Divisor *divisor) {
  uint64_t quotient = (uint64_t)((unsigned __int128)(uint64_t)dividend * divisor->reciprocal >> 64);
  return (int64_t)(quotient + ((uint64_t)dividend - quotient * divisor->by >= divisor->by));
}

#endif
