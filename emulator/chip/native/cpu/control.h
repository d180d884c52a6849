/* The condition operations that decode_cache.c uses. */
#ifndef FCU_CONTROL_H
#define FCU_CONTROL_H

#include "cpu/dispatch.h"

/* Return the operation that skips the next instruction unless the condition holds (A7.3.1); insn->by is the
 * distance. */
Operation skip_unless(unsigned condition);
/* Return the operation that sets core->mask to the condition; an odd condition sets the opposite. */
Operation mask_operation(unsigned condition);

#endif
