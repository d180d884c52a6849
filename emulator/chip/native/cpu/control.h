/* The condition operations that decode_cache.c uses. */
#ifndef FCU_CONTROL_H
#define FCU_CONTROL_H

#include "cpu/dispatch.h"

/* Return the operation that skips the next instruction unless the condition holds (A7.3.1); insn->by is the
 * distance. */
Operation unless(unsigned condition);
/* Return the operation that sets core->mask to the condition; an odd condition sets the opposite. */
Operation set_mask(unsigned condition);

#endif
