/* What decode_cache.c needs of conditions. */
#ifndef FCU_CONTROL_H
#define FCU_CONTROL_H

#include "cpu/dispatch.h"

/* What goes to the instruction after the next one unless the condition holds (A7.3.1); insn->by is how far. */
Operation unless(unsigned condition);
/* What sets core->mask to whether the condition holds, or its opposite if it is an odd one. */
Operation set_mask(unsigned condition);

#endif
