/* Create and discard basic blocks; decode_cache.h explains them. */
#include "cpu/decode_cache.h"

#include <stdlib.h>
#include <string.h>

#include "cpu/control.h"
#include "fcu.h"
#include "cpu/transfers.h"

#define CAPACITY 65536 /* steps; twice as many as a firmware of 100 KB needs */
#define MAX_BLOCK 64   /* instructions; a block may have four more, so that no IT block is split */
#define MAX_STEPS 5    /* maximum number of steps of one instruction, including its two link steps */
#define MAX_BLOCK_STEPS (MAX_STEPS * (MAX_BLOCK + 4) + 2)

struct DecodeCache {
  uint32_t used; /* offset 0 means none */
  Insn insns[CAPACITY], prefix[MAX_BLOCK_STEPS], single[MAX_STEPS + 2];
};

/* -- steps other than instructions -------------------------------------------------------------------- */

OPERATION(return_to_loop) {
  exit_chain(core, insn->address, budget);
  core->itstate = insn->it;
}

OPERATION(follow_link) { TAIL enter_block(core, insn->next, budget); }

OPERATION(resolve_link) {
  exit_chain(core, insn->address, budget);
  core->unresolved_link = insn;
}

/* This step is inserted before an instruction with R15 as an operand. Such an operand is UNPREDICTABLE; in
 * this model its value is the instruction's address. */
COMPUTATION(set_pc, core->r[15] = insn->address)

COMPUTATION(align_sp, core->r[13] &= ~3u)

OPERATION(branch_to_pc) {
  const Insn *next = block_at(core, core->r[15] & ~1u);
  TAIL enter_block(core, next, budget);
}

OPERATION(undefined) { stop_at(core, insn, budget, STOP_UNDEFINED); }

typedef struct {
  Core *core;
  const Memory *memory;
  Insn *at;
  uint32_t address;
  uint8_t it;
} BlockBuilder;

static Insn *emit(BlockBuilder *builder, Operation run) {
  *builder->at = (Insn){.run = run, .address = builder->address, .it = builder->it};
  return builder->at++;
}

static void emit_link(BlockBuilder *builder, uint32_t address) {
  Insn *link = emit(builder, resolve_link);
  link->address = address;
  link->next = link;
}

static Insn decode_at(const Core *core, const Memory *memory, uint32_t address, uint8_t it) {
  uint32_t offset = address - memory->base;
  uint16_t first = 0, second = 0;
  memcpy(&first, memory->bytes + offset, 2);
  if (offset + 4 <= memory->size) {
    memcpy(&second, memory->bytes + offset + 2, 2);
  }
  Insn insn = {.address = address, .it = it, .remaining = 1};
  if (!(first >> 11 >= 0x1D ? decode32(address, first, second, &insn) : decode16(address, first, &insn))) {
    insn = (Insn){.run = undefined, .address = address, .it = it, .remaining = 1, .flags = ENDS_BLOCK};
  }
  if (!core->fpu_on && is_floating_point(first, second)) {
    insn = (Insn){.run = no_coprocessor, .address = address, .it = it, .remaining = 1, .flags = ENDS_BLOCK};
  }
  bool has_core_registers = (first & 0xEC00) != 0xEC00; /* not VFP */
  if (has_core_registers && (insn.d == 15 || insn.n == 15 || insn.m == 15 || insn.a == 15)) {
    insn.flags |= READS_PC;
  }
  return insn;
}

static void emit_insn(BlockBuilder *builder, Insn insn) {
  const Memory *memory = builder->memory;
  uint32_t offset = insn.imm - memory->base;
  if (insn.flags & READS_PC) {
    emit(builder, set_pc);
  }
  if (insn.flags & LITERAL && memory->size >= 4 && offset <= memory->size - 4 && !builder->core->watching) {
    make_literal(&insn, memory->bytes + offset);
  }
  *builder->at++ = insn;
  if (insn.flags & WRITES_SP) {
    emit(builder, insn.flags & ENDS_BLOCK ? branch_to_pc : align_sp);
  }
}

static void emit_links(BlockBuilder *builder, const Insn *last) {
  emit_link(builder, builder->address);
  if (last->flags & DIRECT_BRANCH) {
    emit_link(builder, last->imm);
  }
}

/* If the preceding step is IT, change this step into the conditional skip of the first instruction in the
 * IT block. Otherwise insert a skip. */
static Insn *emit_condition(BlockBuilder *builder) {
  Insn *before = builder->at - 1;
  Insn *condition = before->flags & IS_IT ? before : emit(builder, NULL);
  condition->run = skip_unless(builder->it >> 4);
  return condition;
}

/* Consecutive predicated instructions share one it_mask. The step before the first of these instructions
 * sets it_mask; this step may be the IT instruction. */
static void emit_predicated(BlockBuilder *builder, Insn insn) {
  Insn *before = builder->at - 1;
  if (before->flags & IS_IT) {
    before->run = mask_operation(insn.it >> 4);
  } else if (!(before->flags & PREDICATED)) {
    emit(builder, mask_operation(insn.it >> 4));
  }
  *builder->at++ = insn;
}

static void mark_decoded(BlockBuilder *builder) {
  const Memory *memory = builder->memory;
  uint32_t begin = builder->address - memory->base, end = address_after(memory, builder->address) - memory->base;
  for (uint32_t at = begin; at < end && at < memory->size; at += 2) {
    memory->code_flags[at >> 1] |= DECODED;
  }
  if (memory->writable) {
    builder->core->slow_stores |= STORES_CHANGE_CODE;
    core_update_fast_limits(builder->core);
  }
}

/* Return false if the block is complete. */
static bool emit_next(BlockBuilder *builder, bool is_first, bool may_continue) {
  const Memory *memory = builder->memory;
  if (builder->address - memory->base >= memory->size || (!is_first && is_stepped(memory, builder->address))) {
    emit(builder, return_to_loop);
    return false;
  }
  Insn insn = decode_at(builder->core, memory, builder->address, builder->it), *condition = NULL;
  bool rest_of_it = it_advance(builder->it);
  if (rest_of_it && insn.flags & ENDS_BLOCK) { /* end the block: before the end of an IT block a branch is
                                                  UNPREDICTABLE, and other instructions that end a block are rare, so
                                                  they are executed one by one */
    emit(builder, return_to_loop);
    return false;
  }
  mark_decoded(builder);
  if (insn.flags & PREDICATED) {
    emit_predicated(builder, insn);
  } else {
    if (builder->it && !(insn.flags & UNCONDITIONAL)) {
      condition = emit_condition(builder);
    }
    emit_insn(builder, insn);
    if (condition) {
      condition->shift = (uint8_t)(builder->at - condition);
    }
  }
  builder->address = address_after(memory, builder->address);
  builder->it = (uint8_t)(insn.flags & IS_IT ? insn.imm : it_advance(builder->it));
  if (insn.flags & ENDS_BLOCK || (!may_continue && !builder->it)) {
    emit_links(builder, &insn);
    return false;
  }
  return true;
}

static Insn *build_block(Core *core, const Memory *memory, uint32_t address, Insn *first) {
  BlockBuilder builder = {core, memory, first, address, 0};
  for (unsigned count = 1; emit_next(&builder, count == 1, count < MAX_BLOCK); count++) {
  }
  for (Insn *insn = builder.at - 2; insn >= first; insn--) {
    insn->remaining = (uint8_t)(insn->remaining + insn[1].remaining);
  }
  return builder.at;
}

static Memory *memory_at(Core *core, uint32_t address) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (address - memory->base < memory->size) {
      return memory;
    }
  }
  return NULL;
}

/* Discard all blocks, and end the current chain after this instruction. */
static void flush(Core *core) {
  DecodeCache *cache = core->decode_cache;
  int64_t work = WORK_DECODE * (int64_t)cache->used;
  core->chip->work += work;
  core->chip->costs.instructions.work += work;
  for (const Insn *insn = cache->insns + 1; insn < cache->insns + cache->used; insn++) {
    Memory *memory = memory_at(core, insn->address);
    if (memory) {
      uint32_t slot = (insn->address - memory->base) >> 1;
      memory->blocks[slot] = 0;
      memory->code_flags[slot] &= BREAKPOINT | LOGGED;
      if (slot + 1 < memory->size / 2) {
        memory->code_flags[slot + 1] &= BREAKPOINT | LOGGED;
      }
    }
  }
  cache->used = 1;
  core->chain_limit = 0;
  core->unresolved_link = NULL;
  core->slow_stores &= ~(uint32_t)STORES_CHANGE_CODE;
  core_update_fast_limits(core);
}

void core_invalidate_code(Core *core, uint32_t address, uint32_t size) {
  const Memory *memory = memory_at(core, address);
  uint32_t offset = memory ? address - memory->base : 0;
  bool is_small = memory && size <= 8 && size <= memory->size - offset, is_decoded = !is_small;
  for (uint32_t at = offset; is_small && at < offset + size; at++) {
    is_decoded |= memory->code_flags[at >> 1] & DECODED;
  }
  if (is_decoded && core->decode_cache->used > 1) {
    flush(core);
  }
}

void fcu_flash_programmed(Chip *chip, uint32_t offset, uint32_t size) {
  for (Memory *memory = chip->core.memory; memory < chip->core.memory + MEMORIES; memory++) {
    if (memory->bytes == chip->flash) {
      core_invalidate_code(&chip->core, memory->base + offset, size);
    }
  }
}

void fcu_invalidate_code(Chip *chip) { core_invalidate_code(&chip->core, FLASH_BASE, UINT32_MAX); }

void decode_cache_flag(Core *core, uint32_t address, enum CodeFlag flag, int32_t on) {
  const Memory *memory = memory_at(core, address);
  if (memory) {
    uint8_t *flags = &memory->code_flags[(address - memory->base) >> 1];
    *flags = (uint8_t)(on ? *flags | flag : *flags & ~flag);
  }
}

void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on) {
  core_invalidate_code(&chip->core, address, 1);
  decode_cache_flag(&chip->core, address, BREAKPOINT, on);
}

const Insn *decode_cache_block(Core *core, const Memory *memory, uint32_t address) {
  DecodeCache *cache = core->decode_cache;
  uint32_t *offset = &memory->blocks[(address - memory->base) >> 1];
  if (!*offset) {
    if (cache->used > CAPACITY - MAX_BLOCK_STEPS) {
      flush(core);
    }
    Insn *first = cache->insns + cache->used;
    cache->used = (uint32_t)(build_block(core, memory, address, first) - cache->insns);
    *offset = (uint32_t)((uint8_t *)first - (uint8_t *)cache->insns);
  }
  const Insn *block = (const Insn *)((const uint8_t *)cache->insns + *offset);
  Insn *link = (Insn *)core->unresolved_link;
  if (link && link->address == address) {
    link->next = block;
    link->run = follow_link;
  }
  core->unresolved_link = NULL;
  return block;
}

const Insn *decode_cache_prefix(Core *core, const Insn *block, unsigned count) {
  Insn *prefix = core->decode_cache->prefix;
  /* steps from `rest` on are not copied; they contain at least `most` instructions */
  unsigned most = block->remaining - count;
  const Insn *rest = block;
  for (const Insn *insn = block + 1; insn->remaining >= most; insn++) {
    bool begins = insn->address != insn[-1].address && !insn->it;
    rest = begins ? insn : rest;
  }
  if (rest == block) {
    return NULL;
  }
  size_t length = (size_t)(rest - block);
  memcpy(prefix, block, length * sizeof *prefix);
  for (size_t n = 0; n < length; n++) {
    prefix[n].remaining = (uint8_t)(prefix[n].remaining - rest->remaining);
  }
  prefix[length] = (Insn){.run = return_to_loop, .address = rest->address};
  return prefix;
}

const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address) {
  Insn *single = core->decode_cache->single;
  BlockBuilder builder = {core, memory, single, address, (uint8_t)core->itstate};
  Insn insn = decode_at(core, memory, address, builder.it);
  emit_insn(&builder, insn);
  builder.address = address_after(memory, address);
  emit_links(&builder, &insn);
  return single;
}

bool decode_cache_create(Core *core) {
  core->decode_cache = calloc(1, sizeof(DecodeCache));
  if (!core->decode_cache) {
    return false;
  }
  core->decode_cache->used = 1;
  core->insns = core->decode_cache->insns;
  return true;
}

void decode_cache_destroy(Core *core) { free(core->decode_cache); }
