/* The read cache of sensors' bytes: a master reads them without a call into Python for each byte or message.
 *
 * A Target is one sensor at one bus. For a sub-address Python gives the bytes that follow, the end of their
 * validity, and the quiet reads. A quiet read has no visible side effect (sensors/register_file.py). C keeps them
 * across messages. They need no call as long as they are valid and the sensor's version is the same. Reads that are
 * not quiet are reported to Python before any of its code runs (emulator/chip/read_cache.py). Until then, following
 * reads are counted with them.
 *
 * A master calls target_begin(chip, target, address, 0), then target_read(chip, target, &byte) for each byte, then
 * target_end(). If begin or read returns false, the master reads live: one call into Python for each byte. Python's
 * side of the bus does not know the sub-address then; chip->read_cache.positions contains it.
 */
#ifndef FCU_READ_CACHE_H
#define FCU_READ_CACHE_H

#include "peripherals/peripheral.h"

#define TARGETS 8
#define CACHE_LINES 32
#define LINE_BYTES 32
#define FIXED_ADDRESS 1u /* of quiet: the sub-address does not advance, so each byte is in a separate message */
#define POSITION_SYNCED ((int64_t)-1) /* Python's side has the current sub-address */

/* The bytes from a sub-address. */
typedef struct {
  int64_t valid_until_ps;
  uint64_t version, side_effect_free; /* bit n: a read of the first n of them is quiet */
  uint8_t address, count;  /* count 0: unknown, or (valid_until_ps) the bytes must be read live */
  uint8_t expected;          /* how many bytes the last message read from here */
  uint8_t bytes[LINE_BYTES];
} CacheLine;

typedef struct {
  const uint64_t *version; /* the sensor's version counter, in Python's memory */
  CacheLine lines[CACHE_LINES]; /* indexed by the low bits of the sub-address */
  CacheLine line;             /* in progress, or the last one */
  uint8_t used;        /* bytes of it that have been read */
  uint8_t first, total;    /* the sub-address at which the read began, and its bytes so far */
  uint8_t dirty;            /* the run was not quiet when it ended: its cached bytes are wrong now */
} Target;

/* Callbacks into Python. */
typedef struct {
  /* Prefetch about count bytes from address, or from the sub-address that `skip` bytes from there lead to. Return
   * their number; the bytes are in chip->read_cache.prefetched. 0: they must be read live. */
  int32_t (*prefetch)(int64_t now_ps, int32_t target, int32_t address, int32_t skip, int32_t count);
  /* Report the reads in C that Python has not yet received (`unreported`), as before every other callback. */
  void (*commit)(int64_t now_ps);
} TargetCalls;

/* The bytes of Python's answer. */
typedef struct {
  int64_t valid_until_ps;
  uint64_t side_effect_free;
  int64_t address;
  uint8_t bytes[LINE_BYTES];
} Prefetched;

/* All targets of a chip; Python accesses this struct (read_cache.py). */
typedef struct {
  uint64_t uncommitted;         /* bit = target: Python has not yet received a read in C, namely: */
  int64_t reads[TARGETS];      /* address << 8 | count */
  int64_t positions[TARGETS];  /* the sub-address, in the same form; or POSITION_KNOWN */
  uint64_t answered[TARGETS];  /* the sensor's version when it last acknowledged its address */
  Prefetched prefetched;
  TargetCalls calls;
  int32_t count;
  Target target[TARGETS];
} ReadCache;

void read_cache_create(Chip *chip);
/* Begin a read at `address`, or at the sub-address that `skip` bytes from there lead to. True if C has the bytes. */
bool target_begin(Chip *chip, Target *target, uint8_t address, uint8_t skip);
/* Python has prefetched `count` bytes without a request: the read continues with them. */
void target_prefetched(Chip *chip, Target *target, uint32_t count);
/* Read the next byte, at chip->now_ps; false: it must be read live, and the read has ended. */
bool target_read(Chip *chip, Target *target, uint8_t *byte);
/* End the current read. */
void target_end(Chip *chip, Target *target);
/* Return true if the sensor certainly acknowledges its address. */
bool target_acknowledges(const Chip *chip, const Target *target);
/* Record that the sensor has just acknowledged its address. */
void target_acknowledged(Chip *chip, const Target *target);
/* Discard all cached bytes of the target. */
void target_invalidate(Chip *chip, Target *target);

#endif
