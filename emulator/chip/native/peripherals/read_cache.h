/* Read cache of sensors' bytes, to avoid calls of Python.
 *
 * A Target is a sensor at a bus. From a sub-address Python prefetches bytes, their validity, and which reads are
 * side-effect free (sensors/register_file.py). C caches them until they expire or the sensor's version changes.
 * Other reads make the line dirty, and are committed to Python before any of its code runs
 * (emulator/chip/read_cache.py).
 *
 * A bus master calls target_begin(), target_read() for each byte, target_end(). After false it reads live, with a
 * call of Python for each byte, from the sub-address in positions.
 */
#ifndef FCU_READ_CACHE_H
#define FCU_READ_CACHE_H

#include "peripherals/peripheral.h"

#define TARGETS 8
#define CACHE_LINES 32
#define LINE_BYTES 32
#define FIXED_ADDRESS 1u              /* in side_effect_free: each byte has its own line */
#define POSITION_SYNCED ((int64_t)-1) /* Python has the sub-address */

typedef struct {
  int64_t valid_until_ps;
  uint64_t version, side_effect_free; /* bit n: a read of the first n bytes has no side effect */
  uint8_t address, count;             /* 0: unknown, or live until valid_until_ps */
  uint8_t expected;                   /* length of the last read from here */
  uint8_t bytes[LINE_BYTES];
} CacheLine;

typedef struct {
  const uint64_t *version;
  CacheLine lines[CACHE_LINES]; /* by the lowest bits of the sub-address */
  CacheLine line;               /* current or latest */
  uint8_t used;
  uint8_t first, total; /* sub-address and length of the read */
  uint8_t dirty;        /* the cached bytes are outdated by side effects */
} Target;

typedef struct {
  /* Prefetch about count bytes from `skip` bytes after address into chip->read_cache.prefetched. Return their
   * number; 0: live. */
  int32_t (*prefetch)(int64_t now_ps, int32_t target, int32_t address, int32_t skip, int32_t count);
  /* Commit reads to Python. */
  void (*commit)(int64_t now_ps);
} TargetCalls;

typedef struct {
  int64_t valid_until_ps;
  uint64_t side_effect_free;
  int64_t address;
  uint8_t bytes[LINE_BYTES];
} Prefetched;

/* Python accesses this struct (read_cache.py). */
typedef struct {
  uint64_t uncommitted;       /* bit = target; its read: */
  int64_t reads[TARGETS];     /* address << 8 | count */
  int64_t positions[TARGETS]; /* likewise; or POSITION_SYNCED */
  uint64_t answered[TARGETS]; /* the version at the latest acknowledge */
  Prefetched prefetched;
  TargetCalls calls;
  int32_t count;
  Target target[TARGETS];
} ReadCache;

void read_cache_create(Chip *chip);
/* Begin at `skip` bytes after address; false: read live. */
bool target_begin(Chip *chip, Target *target, uint8_t address, uint8_t skip);
/* Continue with bytes that Python has prefetched without a request. */
void target_prefetched(Chip *chip, Target *target, uint32_t count);
/* Read the next byte; false: continue live. */
bool target_read(Chip *chip, Target *target, uint8_t *byte);
void target_end(Chip *chip, Target *target);
/* Return true if the sensor certainly acknowledges its address. */
bool target_acknowledges(const Chip *chip, const Target *target);
void target_acknowledged(Chip *chip, const Target *target);
void target_invalidate(Chip *chip, Target *target);

#endif
