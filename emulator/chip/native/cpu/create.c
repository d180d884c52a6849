/* Create and destroy a core. */
#include <stdlib.h>
#include <string.h>

#include "cpu/decode_cache.h"

static bool add_memory(Core *core, uint32_t base, uint8_t *bytes, uint32_t size, bool writable) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (!memory->bytes) {
      *memory = (Memory){base, size, bytes, calloc(size / 2, sizeof(uint32_t)), calloc(size / 2, 1), writable};
      return memory->blocks && memory->code_flags;
    }
  }
  return false;
}

bool core_create(Core *core, Chip *chip, uint8_t *flash, uint8_t *ram, uint8_t *system) {
  core->chip = chip;
  core->ram = ram;
  core->flash = flash;
  core->thumb = 1;
  core->step_over = 1; /* no instruction has this address */
  bool made = decode_cache_create(core) && add_memory(core, FLASH_BASE, flash, FLASH_SIZE, false) &&
              add_memory(core, RAM_BASE, ram, RAM_SIZE, true) && add_memory(core, 0, flash, FLASH_SIZE, false) &&
              add_memory(core, SYSTEM_MEMORY_BASE, system, SYSTEM_MEMORY_SIZE, false);
  if (made) {
    core_update_fast_limits(core);
  }
  return made;
}

void core_destroy(Core *core) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    free(memory->blocks);
    free(memory->code_flags);
  }
  decode_cache_destroy(core);
}

void core_reset(Core *core) {
  memset(core->r, 0, CORE_STATE_SIZE);
  core->exclusive = 0;
}
