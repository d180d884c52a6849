/* The read cache of sensors' bytes; read_cache.h explains it. */
#include "fcu.h"

#include <string.h>

#define LIVE_PS (PS_PER_S / 100) /* the pause before Python is asked again for bytes that must be read live */

static uint64_t bit_of(const Chip *chip, const Target *target) {
  return UINT64_C(1) << (target - chip->read_cache.target);
}

static int index_of(const Chip *chip, const Target *target) { return (int)(target - chip->read_cache.target); }

static CacheLine *kept_at(Target *target, uint8_t address) { return &target->lines[address % CACHE_LINES]; }

static bool is_valid(const Chip *chip, const Target *target, const CacheLine *run) {
  return run->version == *target->version && chip->now_ps < run->valid_until_ps;
}

/* Return true if the run was not quiet and Python has already received it. */
static bool is_reported(const Chip *chip, const Target *target) {
  return target->loud && !(chip->read_cache.unreported & bit_of(chip, target));
}

static bool goes_on(const Chip *chip, const Target *target) {
  return target->consumed < target->run.count && is_valid(chip, target, &target->run);
}

/* Discard the cached bytes of a finished run if the run was not quiet. */
static void leave_run(Target *target) {
  CacheLine *kept = kept_at(target, target->run.address);
  if (target->loud && kept->address == target->run.address) {
    kept->valid_until_ps = 0;
  }
  target->loud = 0;
}

/* Return true if the next byte is from the same register as the last one. */
static bool stays(const Target *target) { return target->run.quiet & EACH_ALONE && target->total; }

/* Return the sub-address: a number of bytes after an address. */
static int64_t position_of(const Target *target) {
  uint8_t next = target->run.address + target->consumed;
  if (target->run.quiet & EACH_ALONE) {
    return stays(target) ? (int64_t)(uint8_t)(next - 1) << 8 | 1 : (int64_t)next << 8;
  }
  return (int64_t)target->run.address << 8 | target->consumed;
}

static void leave_position(Chip *chip, const Target *target) {
  chip->read_cache.positions[index_of(chip, target)] = position_of(target);
}

/* Return the number of bytes usually read from a sub-address, as far as known. */
static uint8_t wanted_from(Target *target, uint8_t address) {
  const CacheLine *kept = kept_at(target, address);
  return kept->address == address && kept->wanted ? kept->wanted : 1;
}

static void want(Target *target) {
  CacheLine *kept = kept_at(target, target->first);
  if (kept->address == target->first && target->total) {
    kept->wanted = target->total;
  }
}

static void enter_run(Target *target, const CacheLine *run) {
  target->run = *run;
  target->consumed = 0;
}

/* Cache Python's answer in chip->read_cache.prefetched. */
static CacheLine *keep(Chip *chip, Target *target, uint32_t count) {
  const Prefetched *prefetched = &chip->read_cache.prefetched;
  uint8_t address = (uint8_t)prefetched->address;
  CacheLine *run = kept_at(target, address);
  run->wanted = run->address == address ? run->wanted : 0;
  run->address = address;
  run->version = *target->version;
  run->count = (uint8_t)(count < LINE_BYTES ? count : LINE_BYTES);
  run->valid_until_ps = count ? prefetched->valid_until_ps : chip->now_ps + LIVE_PS;
  run->quiet = prefetched->quiet;
  memcpy(run->bytes, prefetched->bytes, LINE_BYTES);
  if (count) {
    target_has_answered(chip, target);
  }
  return run;
}

static bool ask(Chip *chip, Target *target, uint8_t address, uint8_t skip, uint8_t wanted) {
  leave_run(target);
  int32_t count = chip->read_cache.calls.prefetch(chip->now_ps, index_of(chip, target), address, skip, wanted);
  const CacheLine *run = keep(chip, target, (uint32_t)count);
  if (count) {
    enter_run(target, run);
  }
  return count != 0;
}

static bool begin(Chip *chip, Target *target, uint8_t address, uint8_t skip) {
  bool follows_on = address == target->run.address + target->consumed && target->loud;
  if (skip == 0 && follows_on && goes_on(chip, target)) {
    return true;
  }
  const CacheLine *run = kept_at(target, address);
  bool known = skip == 0 && run->address == address;
  if (!known || (!run->count && !is_valid(chip, target, run))) {
    return ask(chip, target, address, skip, skip ? 1 : wanted_from(target, address));
  }
  leave_run(target);
  if (!run->count) {
    return false;
  }
  if (is_valid(chip, target, run) && chip->read_cache.unreported & bit_of(chip, target)) {
    chip->read_cache.calls.settle(chip->now_ps);
  }
  enter_run(target, run); /* if it is not valid, the first byte asks Python: the line may then be another one */
  return true;
}

bool target_begin(Chip *chip, Target *target, uint8_t address, uint8_t skip) {
  target->first = address;
  target->total = 0;
  return begin(chip, target, address, skip);
}

void target_prefetched(Chip *chip, Target *target, uint32_t count) {
  leave_run(target);
  enter_run(target, keep(chip, target, count));
  target->first = target->run.address;
  target->total = 0;
}

/* Python has received the bytes read: the run is the rest. Which reads of the rest are quiet is unknown. */
static void leave_reported(Target *target) {
  CacheLine *run = &target->run;
  leave_run(target);
  run->count -= target->consumed;
  run->address += target->consumed;
  run->quiet &= EACH_ALONE;
  memmove(run->bytes, run->bytes + target->consumed, run->count);
  target->consumed = 0;
}

bool target_read(Chip *chip, Target *target, uint8_t *byte) {
  if (is_reported(chip, target) && target->consumed < target->run.count) {
    leave_reported(target);
  }
  if (stays(target) || !goes_on(chip, target)) {
    uint8_t wanted = wanted_from(target, target->first);
    uint8_t left = wanted > target->total ? (uint8_t)(wanted - target->total) : 1;
    int64_t position = position_of(target);
    leave_position(chip, target);
    if (!ask(chip, target, (uint8_t)(position >> 8), (uint8_t)position, left)) {
      want(target);
      return false;
    }
  }
  *byte = target->run.bytes[target->consumed++];
  target->total += target->total < LINE_BYTES;
  target->loud = !(target->run.quiet >> target->consumed & 1);
  uint64_t bit = bit_of(chip, target);
  chip->read_cache.unreported = target->loud ? chip->read_cache.unreported | bit : chip->read_cache.unreported & ~bit;
  chip->read_cache.reads[index_of(chip, target)] = (int64_t)target->run.address << 8 | target->consumed;
  return true;
}

void target_end(Chip *chip, Target *target) {
  want(target);
  leave_position(chip, target);
}

bool target_answers(const Chip *chip, const Target *target) {
  return chip->read_cache.answered[index_of(chip, target)] == *target->version;
}

void target_has_answered(Chip *chip, const Target *target) {
  chip->read_cache.answered[index_of(chip, target)] = *target->version;
}

void target_forget(Chip *chip, Target *target) {
  if (chip->read_cache.unreported & bit_of(chip, target)) {
    chip->read_cache.calls.settle(chip->now_ps);
  }
  for (int n = 0; n < CACHE_LINES; n++) {
    target->lines[n] = (CacheLine){0};
  }
  target->run = (CacheLine){0};
  target->loud = 0;
}

void read_cache_create(Chip *chip) {
  for (int n = 0; n < TARGETS; n++) {
    chip->read_cache.positions[n] = POSITION_KNOWN;
    chip->read_cache.answered[n] = UINT64_MAX;
  }
}

ReadCache *fcu_connect_targets(Chip *chip, const TargetCalls *calls) {
  chip->read_cache.calls = *calls;
  return &chip->read_cache;
}

int32_t fcu_add_target(Chip *chip, const uint64_t *version) {
  if (chip->read_cache.count == TARGETS) {
    return -1;
  }
  chip->read_cache.target[chip->read_cache.count].version = version;
  return chip->read_cache.count++;
}
