/* Writes to PC that may change the state: BX, BLX, and loads of PC. */
#ifndef FCU_BRANCH_H
#define FCU_BRANCH_H

#include "core.h"

/* BLXWritePC (A2.3.1). The last thing an operation does, as with execute(). */
static inline void branch_interworking(Core *core, uint32_t target) {
  core->thumb = target & 1;
  if (LIKELY(core->thumb)) {
    execute_at(core, target & ~1u);
    return;
  }
  core->r[15] = target;
  if (core->counter < core->limit) {
    core_invalid_state(core);
  }
}

/* BXWritePC (A2.3.1): also LDR, LDM and POP of PC. */
static inline void branch_exchange(Core *core, uint32_t target) {
  if (UNLIKELY(target >> 28 == 0xF && in_handler(core))) {
    core->r[15] = target & ~1u;
    stop_behind(core, STOP_EXCEPTION_RETURN);
  } else {
    branch_interworking(core, target);
  }
}

#endif
