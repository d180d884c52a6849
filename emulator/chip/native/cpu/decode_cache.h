/* DecodeCache: basic blocks of decoded instructions, up to one that may change PC.
 *
 * A block can begin at any address that execution has reached. Between instructions there are other steps, such as
 * the conditions of IT blocks. It ends with a link to the following address, and after a branch a second one to its
 * target, which are resolved when first used; or with a return to the loop.
 *
 * Single blocks cannot be removed: when code changes or the storage is full, all are discarded.
 */
#ifndef FCU_DECODE_CACHE_H
#define FCU_DECODE_CACHE_H

#include "cpu/dispatch.h"

enum CodeFlag { DECODED = 1, BREAKPOINT = 2 };

/* False: no host memory. */
bool decode_cache_create(Core *core);
void decode_cache_destroy(Core *core);

/* Also resolves the link that execution came from. */
const Insn *decode_cache_block(Core *core, const Memory *memory, uint32_t address);
/* At most `count` instructions of a block, then a return to the loop. NULL: an IT block does not fit. */
const Insn *decode_cache_prefix(Core *core, const Insn *block, unsigned count);
/* One instruction, then a return to the loop. The caller checks the condition of core->itstate. */
const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address);

/* Of the next instruction. */
static inline uint32_t address_after(const Memory *memory, uint32_t address) {
  uint16_t first;
  __builtin_memcpy(&first, memory->bytes + (address - memory->base), 2);
  return address + (first >> 11 >= 0x1D ? 4 : 2);
}

static inline bool has_breakpoint(const Memory *memory, uint32_t address) {
  return memory->code_flags[(address - memory->base) >> 1] & BREAKPOINT;
}

#endif
