/* Read cache of sensors' bytes. */
#include "fcu.h"

#include <string.h>

#define LIVE_PS (PS_PER_S / 100) /* bytes read live are prefetched again after this time */

static uint64_t bit_of(const Chip *chip, const Target *target) {
  return UINT64_C(1) << (target - chip->read_cache.target);
}

static int index_of(const Chip *chip, const Target *target) { return (int)(target - chip->read_cache.target); }

static CacheLine *line_at(Target *target, uint8_t address) { return &target->lines[address % CACHE_LINES]; }

static bool is_valid(const Chip *chip, const Target *target, const CacheLine *line) {
  return line->version == *target->version && chip->now_ps < line->valid_until_ps;
}

/* Return true if Python has received the reads of a dirty line. */
static bool is_committed(const Chip *chip, const Target *target) {
  return target->dirty && !(chip->read_cache.uncommitted & bit_of(chip, target));
}

static bool has_next(const Chip *chip, const Target *target) {
  return target->used < target->line.count && is_valid(chip, target, &target->line);
}

/* Side effects outdate the cached bytes. */
static void leave_line(Target *target) {
  CacheLine *cached = line_at(target, target->line.address);
  if (target->dirty && cached->address == target->line.address) {
    cached->valid_until_ps = 0;
  }
  target->dirty = 0;
}

static bool repeats_register(const Target *target) {
  return target->line.side_effect_free & FIXED_ADDRESS && target->total;
}

static int64_t position_of(const Target *target) {
  uint8_t next = target->line.address + target->used;
  if (target->line.side_effect_free & FIXED_ADDRESS) {
    return repeats_register(target) ? (int64_t)(uint8_t)(next - 1) << 8 | 1 : (int64_t)next << 8;
  }
  return (int64_t)target->line.address << 8 | target->used;
}

static void save_position(Chip *chip, const Target *target) {
  chip->read_cache.positions[index_of(chip, target)] = position_of(target);
}

static uint8_t expected_from(Target *target, uint8_t address) {
  const CacheLine *cached = line_at(target, address);
  return cached->address == address && cached->expected ? cached->expected : 1;
}

static void save_expected(Target *target) {
  CacheLine *cached = line_at(target, target->first);
  if (cached->address == target->first && target->total) {
    cached->expected = target->total;
  }
}

static void enter_line(Target *target, const CacheLine *line) {
  target->line = *line;
  target->used = 0;
}

/* The bytes are in chip->read_cache.prefetched. */
static CacheLine *fill_line(Chip *chip, Target *target, uint32_t count) {
  const Prefetched *prefetched = &chip->read_cache.prefetched;
  uint8_t address = (uint8_t)prefetched->address;
  CacheLine *line = line_at(target, address);
  line->expected = line->address == address ? line->expected : 0;
  line->address = address;
  line->version = *target->version;
  line->count = (uint8_t)(count < LINE_BYTES ? count : LINE_BYTES);
  line->valid_until_ps = count ? prefetched->valid_until_ps : chip->now_ps + LIVE_PS;
  line->side_effect_free = prefetched->side_effect_free;
  memcpy(line->bytes, prefetched->bytes, LINE_BYTES);
  if (count) {
    target_acknowledged(chip, target);
  }
  return line;
}

static bool prefetch_line(Chip *chip, Target *target, uint8_t address, uint8_t skip, uint8_t expected) {
  leave_line(target);
  int32_t count = chip->read_cache.calls.prefetch(chip->now_ps, index_of(chip, target), address, skip, expected);
  const CacheLine *line = fill_line(chip, target, (uint32_t)count);
  if (count) {
    enter_line(target, line);
  }
  return count != 0;
}

static bool begin(Chip *chip, Target *target, uint8_t address, uint8_t skip) {
  bool continues = address == target->line.address + target->used && target->dirty;
  if (skip == 0 && continues && has_next(chip, target)) {
    return true;
  }
  const CacheLine *line = line_at(target, address);
  bool known = skip == 0 && line->address == address;
  if (!known || (!line->count && !is_valid(chip, target, line))) {
    return prefetch_line(chip, target, address, skip, skip ? 1 : expected_from(target, address));
  }
  leave_line(target);
  if (!line->count) {
    return false;
  }
  if (is_valid(chip, target, line) && chip->read_cache.uncommitted & bit_of(chip, target)) {
    chip->read_cache.calls.commit(chip->now_ps);
  }
  enter_line(target, line); /* outdated: the first byte asks Python */
  return true;
}

bool target_begin(Chip *chip, Target *target, uint8_t address, uint8_t skip) {
  target->first = address;
  target->total = 0;
  return begin(chip, target, address, skip);
}

void target_prefetched(Chip *chip, Target *target, uint32_t count) {
  leave_line(target);
  enter_line(target, fill_line(chip, target, count));
  target->first = target->line.address;
  target->total = 0;
}

/* Keep the rest of the line; its side effects are unknown. */
static void drop_committed(Target *target) {
  CacheLine *line = &target->line;
  leave_line(target);
  line->count -= target->used;
  line->address += target->used;
  line->side_effect_free &= FIXED_ADDRESS;
  memmove(line->bytes, line->bytes + target->used, line->count);
  target->used = 0;
}

bool target_read(Chip *chip, Target *target, uint8_t *byte) {
  if (is_committed(chip, target) && target->used < target->line.count) {
    drop_committed(target);
  }
  if (repeats_register(target) || !has_next(chip, target)) {
    uint8_t expected = expected_from(target, target->first);
    uint8_t left = expected > target->total ? (uint8_t)(expected - target->total) : 1;
    int64_t position = position_of(target);
    save_position(chip, target);
    if (!prefetch_line(chip, target, (uint8_t)(position >> 8), (uint8_t)position, left)) {
      save_expected(target);
      return false;
    }
  }
  *byte = target->line.bytes[target->used++];
  target->total += target->total < LINE_BYTES;
  target->dirty = !(target->line.side_effect_free >> target->used & 1);
  uint64_t bit = bit_of(chip, target), *uncommitted = &chip->read_cache.uncommitted;
  *uncommitted = target->dirty ? *uncommitted | bit : *uncommitted & ~bit;
  chip->read_cache.reads[index_of(chip, target)] = (int64_t)target->line.address << 8 | target->used;
  return true;
}

void target_end(Chip *chip, Target *target) {
  save_expected(target);
  save_position(chip, target);
}

bool target_acknowledges(const Chip *chip, const Target *target) {
  return chip->read_cache.answered[index_of(chip, target)] == *target->version;
}

void target_acknowledged(Chip *chip, const Target *target) {
  chip->read_cache.answered[index_of(chip, target)] = *target->version;
}

void target_invalidate(Chip *chip, Target *target) {
  if (chip->read_cache.uncommitted & bit_of(chip, target)) {
    chip->read_cache.calls.commit(chip->now_ps);
  }
  for (int n = 0; n < CACHE_LINES; n++) {
    target->lines[n] = (CacheLine){0};
  }
  target->line = (CacheLine){0};
  target->dirty = 0;
}

void read_cache_create(Chip *chip) {
  for (int n = 0; n < TARGETS; n++) {
    chip->read_cache.positions[n] = POSITION_SYNCED;
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
