/* Conditions that decode_cache.c inserts in IT blocks. */
#ifndef FCU_CONTROL_H
#define FCU_CONTROL_H

#include "cpu/dispatch.h"

/* Return an operation that skips insn->shift steps if the condition does not hold (A7.3.1). */
Operation skip_unless(unsigned condition);
/* Return an operation that sets core->it_mask for the even condition of a pair; for the odd condition
 * insn->a inverts the mask. */
Operation mask_operation(unsigned condition);

#endif
