/* Conditions that decode_cache.c inserts in IT blocks. */
#ifndef FCU_CONTROL_H
#define FCU_CONTROL_H

#include "cpu/dispatch.h"

/* Skip insn->shift steps if the condition does not hold (A7.3.1). */
Operation skip_unless(unsigned condition);
/* Set core->it_mask to a condition with an even number. */
Operation mask_operation(unsigned condition);

#endif
