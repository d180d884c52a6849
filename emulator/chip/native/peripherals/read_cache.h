/* What C keeps of a sensor's bytes, so that a master need not call Python for each, nor for each message.
 *
 * A Target is one part at one bus. Python says of a sub-address which bytes come from there on, until when they
 * are these, and which reads of them are quiet, that is, change nothing that anybody could see
 * (sensors/register_file.py). C keeps them across messages: as long as they are valid, and the part's version
 * is the same, reading them needs no call at all. Reads that are not quiet are reported to Python before any of
 * its code runs (emulator/chip/targets.py), and until then reads that follow on are counted with them.
 *
 * A master reads so:
 *   if (target_begin(chip, target, address, 0)) ... target_read(chip, target, &byte) at each byte ... target_end()
 * and goes live, a call into Python for each byte, where begin or read answer false. What Python's side of the
 * bus has not heard of by then is where the sub-address is: chip->target_position.
 */
#ifndef FCU_READ_CACHE_H
#define FCU_READ_CACHE_H

#include "peripherals/peripheral.h"

#define TARGETS 8
#define CACHE_LINES 32
#define LINE_BYTES 32
#define EACH_ALONE 1u /* of quiet: the sub-address does not move on, so each byte is of a message of its own */
#define POSITION_KNOWN ((int64_t)-1) /* Python's side knows where the sub-address is */

/* Bytes from a sub-address on. */
typedef struct {
  int64_t valid_until_ps;
  uint64_t version, quiet; /* bit n: to read the first n of them is quiet */
  uint8_t address, count;  /* count 0: nothing is known, or (valid_until_ps) the bytes have to be read live */
  uint8_t wanted;          /* how many bytes the last message read from here */
  uint8_t bytes[LINE_BYTES];
} CacheLine;

typedef struct {
  const uint64_t *version; /* the part's own; in Python */
  CacheLine lines[CACHE_LINES]; /* by the low bits of the sub-address */
  CacheLine run;             /* being read, or read last */
  uint8_t consumed;        /* bytes of it that have been read */
  uint8_t first, total;    /* the sub-address at which the reading began, and its bytes so far */
  uint8_t loud;            /* the run was not quiet when it ended: what is kept of it is not right any more */
} Target;

/* Callbacks into Python. */
typedef struct {
  /* Which bytes come from address on, or from where `skip` bytes from there lead to; about count of them. The
   * answer's length, the answer itself in chip->prefetched; 0: they have to be read live. */
  int32_t (*prefetch)(int64_t now_ps, int32_t target, int32_t address, int32_t skip, int32_t count);
  /* Reads in C that Python has yet to hear of (`unreported`) are reported, as before every other callback. */
  void (*settle)(int64_t now_ps);
} TargetCalls;

/* What Python answers with. */
typedef struct {
  int64_t valid_until_ps;
  uint64_t quiet;
  int64_t address;
  uint8_t bytes[LINE_BYTES];
} Prefetched;

/* All targets of a chip; Python sees it (targets.py). */
typedef struct {
  uint64_t unreported;         /* bit = target: a read in C that Python has yet to hear of, which is: */
  int64_t reads[TARGETS];      /* address << 8 | count */
  int64_t positions[TARGETS];  /* where the sub-address is, likewise; or POSITION_KNOWN */
  uint64_t answered[TARGETS];  /* the version with which the part has acknowledged its address */
  Prefetched prefetched;
  TargetCalls calls;
  int32_t count;
  Target target[TARGETS];
} ReadCache;

void read_cache_create(Chip *chip);
/* Whether bytes from `address` on can be taken from C now, or from where `skip` bytes from there lead to. */
bool target_begin(Chip *chip, Target *target, uint8_t address, uint8_t skip);
/* Python has prefetched `count` bytes without being asked: the reading goes on with them. */
void target_prefetched(Chip *chip, Target *target, uint32_t count);
/* The next byte, at chip->now_ps; false: it has to be read live, and the reading has ended. */
bool target_read(Chip *chip, Target *target, uint8_t *byte);
/* The reading has ended. */
void target_end(Chip *chip, Target *target);
/* Whether the part is sure to acknowledge its address. */
bool target_answers(const Chip *chip, const Target *target);
/* It has acknowledged it just now. */
void target_has_answered(Chip *chip, const Target *target);
/* Forget all that is kept. */
void target_forget(Chip *chip, Target *target);

#endif
