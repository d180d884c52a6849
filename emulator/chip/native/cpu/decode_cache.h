/* DecodeCache: decoded instructions one behind the other as they are executed, up to one that may change PC.
 *
 * Between them stand steps that are no instructions: conditions, before each instruction of an IT block; links,
 * at the end, from which the next block is entered; what else there is to be done about an instruction. A block
 * begins wherever execution has come to; so instructions may be in several.
 *
 * A block ends with a link to what follows it in memory, and if it ends with a branch, one to the branch's target
 * stands after that. Links lead nowhere until they are first gone through. Where there is nothing to be executed,
 * or something that needs care, a block ends with a step that goes back to the loop.
 *
 * There is no way to remove a block: if code changes or there is no more room, all go.
 */
#ifndef FCU_DECODE_CACHE_H
#define FCU_DECODE_CACHE_H

#include "cpu/dispatch.h"

enum Mark { DECODED = 1, BREAKPOINT = 2 };

/* false: there is no memory for it. */
bool decode_cache_create(Core *core);
void decode_cache_destroy(Core *core);

/* The block at the address, in that memory; the link through which execution has come leads to it from now on. */
const Insn *decode_cache_at(Core *core, const Memory *memory, uint32_t address);
/* At most so many instructions of a block that has more, and then back to the loop; NULL: there is nothing before
 * an IT block, which is not divided. */
const Insn *decode_cache_part(Core *core, const Insn *block, unsigned count);
/* One instruction, and then back to the loop; core->itstate is what it is executed with, but the condition of an IT
 * block is the caller's to look at. */
const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address);

/* The address after the instruction. */
static inline uint32_t address_after(const Memory *memory, uint32_t address) {
  uint16_t first;
  __builtin_memcpy(&first, memory->bytes + (address - memory->base), 2);
  return address + (first >> 11 >= 0x1D ? 4 : 2);
}

static inline bool is_breakpoint(const Memory *memory, uint32_t address) {
  return memory->marks[(address - memory->base) >> 1] & BREAKPOINT;
}

#endif
