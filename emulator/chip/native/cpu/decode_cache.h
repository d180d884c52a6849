/* DecodeCache: decoded instructions in their order of execution, up to one that may change PC.
 *
 * Between the instructions there are extra steps: a condition before each instruction of an IT block, links at the
 * end from which the next block is entered, and other work that an instruction needs. A block begins at any address
 * that execution has reached, so an instruction may be in several blocks.
 *
 * A block ends with a link to the following address in memory. If it ends with a branch, a link to the branch's
 * target follows. A link has no destination until it is first used. Without executable code, or if the code needs
 * care, the block ends with a step that returns to the loop.
 *
 * A single block cannot be removed: if code changes or the storage is full, all blocks are discarded.
 */
#ifndef FCU_DECODE_CACHE_H
#define FCU_DECODE_CACHE_H

#include "cpu/dispatch.h"

enum CodeFlag { DECODED = 1, BREAKPOINT = 2 };

/* Return false if the host has no memory for it. */
bool decode_cache_create(Core *core);
void decode_cache_destroy(Core *core);

/* Return the block at the address in that memory. The link that execution came from now leads to it. */
const Insn *decode_cache_block(Core *core, const Memory *memory, uint32_t address);
/* Return a block of at most `count` instructions of a longer block, then a return to the loop. NULL: the first
 * instructions are an IT block, which is not divided. */
const Insn *decode_cache_prefix(Core *core, const Insn *block, unsigned count);
/* Return a block of one instruction, then a return to the loop. core->itstate is its ITSTATE; the caller checks the
 * condition of the IT block. */
const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address);

/* Return the address after the instruction. */
static inline uint32_t address_after(const Memory *memory, uint32_t address) {
  uint16_t first;
  __builtin_memcpy(&first, memory->bytes + (address - memory->base), 2);
  return address + (first >> 11 >= 0x1D ? 4 : 2);
}

static inline bool has_breakpoint(const Memory *memory, uint32_t address) {
  return memory->code_flags[(address - memory->base) >> 1] & BREAKPOINT;
}

#endif
