/* Log the values that watched instructions compute (value_log.h). */
#include "cpu/value_log.h"

#include <string.h>

#include "cpu/decode_cache.h"
#include "fcu.h"

enum { CORE_REGISTERS = 13 };

static bool is_repeated(ValueLog *log, uint32_t address, uint32_t number, uint32_t value) {
  uint32_t key = address << 6 | number;
  uint32_t slot = (key * 2654435761u) >> 16 & (VALUE_LOG_LATEST - 1);
  if (log->keys[slot] == key && log->latest[slot] == value) {
    return true;
  }
  log->keys[slot] = key;
  log->latest[slot] = value;
  return false;
}

static uint32_t pair_of(const uint32_t *registers, uint32_t number) {
  uint32_t first = number < CORE_REGISTERS ? 0 : CORE_REGISTERS;
  uint32_t other = ((number - first) ^ 1) + first;
  return first == 0 && other >= CORE_REGISTERS ? 0 : registers[other];
}

static void add(ValueLog *log, uint32_t address, const uint32_t *registers, uint32_t number) {
  uint8_t *count = &log->counts[address >> 1 & (VALUE_LOG_ADDRESSES - 1)];
  if (*count == VALUE_LOG_MOST || is_repeated(log, address, number, registers[number])) {
    return;
  }
  ++*count;
  if (log->count == log->capacity) {
    log->lost++;
    return;
  }
  LoggedValue *values = (LoggedValue *)(uintptr_t)log->values;
  values[log->count++] = (LoggedValue){address, number, registers[number], pair_of(registers, number)};
}

/* Return the level of an exception. If an exception has a higher level, it has already returned. */
static ValueLogLevel *level_of(ValueLog *log, uint32_t exception) {
  for (uint32_t level = log->level + 1; level-- > 0;) {
    if (log->levels[level].exception == exception) {
      log->level = level;
      return &log->levels[level];
    }
  }
  log->level += log->level + 1 < VALUE_LOG_LEVELS;
  ValueLogLevel *entered = &log->levels[log->level];
  *entered = (ValueLogLevel){.exception = exception};
  return entered;
}

/* Update the level's copies of the registers, from number `first` on. Log the registers that have changed. */
static void update(ValueLog *log, ValueLogLevel *level, uint32_t first, const uint32_t *current,
                   uint32_t count) {
  uint32_t *registers = level->registers + first;
  if (!memcmp(registers, current, count * sizeof *current)) {
    return;
  }
  uint32_t changed[VALUE_LOG_REGISTERS], changes = 0;
  for (uint32_t index = 0; index < count; index++) {
    if (registers[index] != current[index]) {
      changed[changes++] = first + index;
    }
  }
  memcpy(registers, current, count * sizeof *current);
  if (!level->address) {
    return;
  }
  for (uint32_t index = 0; index < changes; index++) {
    add(log, level->address, level->registers, changed[index]);
  }
}

void value_log_add(Core *core, uint32_t address) {
  ValueLog *log = core->value_log;
  ValueLogLevel *level = level_of(log, core->ipsr);
  update(log, level, 0, core->r, CORE_REGISTERS);
  update(log, level, CORE_REGISTERS, core->s, VALUE_LOG_REGISTERS - CORE_REGISTERS);
  level->address = address;
}

void fcu_log_values(Chip *chip, ValueLog *log) { chip->core.value_log = log; }

void fcu_watch_values(Chip *chip, uint32_t begin, uint32_t end, int32_t on) {
  core_invalidate_code(&chip->core, begin, end - begin);
  for (uint32_t address = begin; address < end; address += 2) {
    decode_cache_flag(&chip->core, address, LOGGED, on);
  }
}
