/* Reads of the sensors' registers, with their effects. */
#include "fcu.h"

#include <string.h>

static int index_of(const Chip *chip, const Target *target) { return (int)(target - chip->sensor_registers.target); }

static int64_t *position_of(Chip *chip, const Target *target) {
  return &chip->sensor_registers.positions[index_of(chip, target)];
}

static uint8_t *memory_of(const Bank *bank) { return (uint8_t *)(uintptr_t)bank->memory; }

static Train *train_of(const Bank *bank, int number) { return (Train *)(uintptr_t)bank->trains[number]; }

static uint64_t bit_of(unsigned address) { return UINT64_C(1) << (address & 63); }

bool target_answers(Chip *chip, Target *target) {
  if (target->known == *target->version) {
    return true;
  }
  int64_t bank = chip->sensor_registers.calls.bank(chip->now_ps, index_of(chip, target));
  if (bank == BANK_REFUSED) {
    return false;
  }
  target->bank = (Bank *)(uintptr_t)bank;
  target->known = *target->version;
  return true;
}

bool target_is_readable(Chip *chip, const Target *target) {
  return target->bank && *position_of(chip, target) != POSITION_SYNCED;
}

void target_set_position(Chip *chip, const Target *target, uint8_t subaddress) {
  *position_of(chip, target) = subaddress & ((SUBADDRESSES - 1) | target->increment_bit);
}

void target_invalidate(Target *target) { target->known = UINT64_MAX; }

/* -- outputs ------------------------------------------------------------------------------------------------------ */

/* Copy the sample to the registers, except for words with a held byte (block data update). */
static void show(Bank *bank, Train *train) {
  const uint8_t *sample = train->samples + train->at * train->width;
  train->is_stale = false;
  for (unsigned n = 0; n < train->width; n++) {
    if (bank->held & (bit_of(train->first + n) | bit_of(train->first + (n ^ 1)))) {
      train->is_stale = true;
    } else {
      memory_of(bank)[train->first + n] = sample[n];
    }
  }
}

static void take(Bank *bank, Train *train, int64_t count) {
  uint8_t *status = &memory_of(bank)[train->status];
  train->at += count;
  train->taken += count;
  if (train->overrun_shift) {
    *status |= (uint8_t)((count > 1 ? train->flags : *status & train->flags) << train->overrun_shift);
  }
  *status |= train->flags;
  train->is_stale = true;
  if (bank->held) {
    show(bank, train);
  }
}

/* Advance the train to the present sample. Return false if the output must be read live. */
static bool take_due(Chip *chip, const Target *target, Bank *bank, int number) {
  Train *train = train_of(bank, number);
  if (train->version == *target->version && train->is_live) {
    return false;
  }
  int64_t due = train->at;
  while (due < train->count && train->times[due] <= chip->now_ps) {
    due++;
  }
  if (train->version != *target->version || train->times[due] <= chip->now_ps) {
    chip->sensor_registers.calls.fill(chip->now_ps, index_of(chip, target), number);
    return train->version == *target->version && !train->is_live;
  }
  if (due > train->at) {
    take(bank, train, due - train->at);
  }
  return true;
}

static uint8_t read_output(Bank *bank, Train *train, uint8_t address) {
  unsigned n = address - train->first;
  if (train->is_stale) {
    show(bank, train);
  }
  memory_of(bank)[train->status] &= train->keep[n];
  if (bank->held & train->releases[n]) {
    bank->held &= ~train->releases[n];
  } else {
    bank->held |= train->holds[n];
  }
  return memory_of(bank)[address];
}

static bool take_all_due(Chip *chip, const Target *target, Bank *bank) {
  for (int n = 0; n < OUTPUTS; n++) {
    if (bank->trains[n] && !take_due(chip, target, bank, n)) {
      return false;
    }
  }
  return true;
}

/* -- bytes -------------------------------------------------------------------------------------------------------- */

bool target_read(Chip *chip, Target *target, uint8_t *byte) {
  int64_t *position = position_of(chip, target);
  if (!target_answers(chip, target) || !target_is_readable(chip, target)) {
    return false;
  }
  Bank *bank = target->bank;
  uint8_t bit = target->increment_bit, address = (uint8_t)(*position & (SUBADDRESSES - 1) & ~bit);
  uint8_t access = bank->access[address];
  if (access >= ACCESS_OUTPUT) {
    if (!take_due(chip, target, bank, access - ACCESS_OUTPUT)) {
      return false;
    }
    *byte = read_output(bank, train_of(bank, access - ACCESS_OUTPUT), address);
  } else if (access == ACCESS_LIVE || (access == ACCESS_STATUS && !take_all_due(chip, target, bank))) {
    return false;
  } else {
    *byte = memory_of(bank)[address];
  }
  if (!bit || *position & bit) {
    *position = bank->next[address] | (*position & bit);
  }
  return true;
}

/* -- connection --------------------------------------------------------------------------------------------------- */

void sensor_registers_create(Chip *chip) {
  for (int n = 0; n < TARGETS; n++) {
    chip->sensor_registers.positions[n] = POSITION_SYNCED;
    target_invalidate(&chip->sensor_registers.target[n]);
  }
}

SensorRegisters *fcu_connect_targets(Chip *chip, const TargetCalls *calls) {
  chip->sensor_registers.calls = *calls;
  return &chip->sensor_registers;
}

int32_t fcu_add_target(Chip *chip, const uint64_t *version, int32_t increment_bit) {
  SensorRegisters *sensors = &chip->sensor_registers;
  if (sensors->count == TARGETS) {
    return -1;
  }
  sensors->target[sensors->count].version = version;
  sensors->target[sensors->count].increment_bit = (uint8_t)increment_bit;
  return sensors->count++;
}
