/* DecodeCache: basic blocks of decoded instructions. Only a block's final instruction may change PC.
 *
 * A block can begin at any address that execution has reached. Besides instructions a block contains other
 * steps, such as the conditions of IT blocks. A block ends with a link to the following address, or with a return
 * to the main loop. If a direct branch ends the block, the block also has a link to the target. A link is resolved
 * when it is first used.
 *
 * When code changes or the storage is full, all blocks are discarded.
 */
#ifndef FCU_DECODE_CACHE_H
#define FCU_DECODE_CACHE_H

#include "cpu/dispatch.h"

enum CodeFlag { DECODED = 1, BREAKPOINT = 2, LOGGED = 4 };

bool decode_cache_create(Core *core);
void decode_cache_destroy(Core *core);

/* Return the block at the address, and build this block if it is missing. Resolve core->unresolved_link if
 * this link leads to the address. */
const Insn *decode_cache_block(Core *core, const Memory *memory, uint32_t address);
/* Return a copy of at most `count` instructions of a block. At its end the copy returns to the main loop. Return
 * NULL if an IT block does not fit. */
const Insn *decode_cache_prefix(Core *core, const Insn *block, unsigned count);
/* Return a copy of one instruction; at its end the copy returns to the main loop. The caller checks the
 * condition of core->itstate. */
const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address);

static inline uint32_t address_after(const Memory *memory, uint32_t address) {
  uint16_t first;
  __builtin_memcpy(&first, memory->bytes + (address - memory->base), 2);
  return address + (first >> 11 >= 0x1D ? 4 : 2);
}

void decode_cache_flag(Core *core, uint32_t address, enum CodeFlag flag, int32_t on);

static inline unsigned code_flags(const Memory *memory, uint32_t address) {
  return memory->code_flags[(address - memory->base) >> 1];
}

/* Instructions that are executed one by one. */
static inline bool is_stepped(const Memory *memory, uint32_t address) {
  return code_flags(memory, address) & (BREAKPOINT | LOGGED);
}

#endif
