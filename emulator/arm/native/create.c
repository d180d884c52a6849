/* A core is made and unmade. */
#include <stdlib.h>

#include "core.h"

#ifndef SOURCES
#define SOURCES ""
#endif

/* What the library was built from, as setup.py has computed it. */
const char *core_sources(void) { return SOURCES; }

static bool add_memory(Core *core, uint32_t base, uint8_t *bytes, uint32_t size, bool writable) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (!memory->bytes) {
      *memory = (Memory){base, size, bytes, calloc(size / 2, sizeof(Insn)), writable};
      return memory->insns != NULL;
    }
  }
  return false;
}

Core *core_create(uint8_t *flash, uint32_t flash_size, uint8_t *ram, uint8_t *system, uint32_t system_size) {
  Core *core = calloc(1, sizeof(Core));
  if (!core) {
    return NULL;
  }
  core->ram = ram;
  core->thumb = 1;
  core->passing = 1; /* no address of an instruction */
  if (!add_memory(core, 0x08000000, flash, flash_size, false) ||
      !add_memory(core, RAM_BASE, ram, RAM_SIZE, true) || !add_memory(core, 0, flash, flash_size, false) ||
      !add_memory(core, 0x1FFF0000, system, system_size, false)) {
    core_destroy(core);
    return NULL;
  }
  return core;
}

void core_destroy(Core *core) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    free(memory->insns);
  }
  free(core);
}
