/* Create and discard basic blocks; decode_cache.h explains them. */
#include "cpu/decode_cache.h"

#include <stdlib.h>
#include <string.h>

#include "cpu/control.h"
#include "fcu.h"
#include "cpu/transfers.h"

#define CAPACITY 65536 /* Insns; half of it is enough for a firmware of 100 KB */
#define LONGEST 64     /* instructions; an IT block is not divided, so a block may have four more */
#define WIDEST 5       /* Insns of one instruction and the end of the block: five, with two links */
#define ROOM (WIDEST * (LONGEST + 4) + 2)

struct DecodeCache {
  uint32_t used; /* the first Insn is unused: offset 0 means no block */
  Insn insns[CAPACITY], part[ROOM], single[WIDEST + 2];
};

/* -- steps that are not instructions --------------------------------------------------------------------- */

OPERATION(to_loop) {
  leave_chain(core, insn->address, budget);
  core->itstate = insn->it;
}

OPERATION(go) { TAIL enter(core, insn->next, budget); }

OPERATION(link_up) {
  leave_chain(core, insn->address, budget);
  core->unlinked = insn;
}

/* Before an instruction that reads PC although the manual says UNPREDICTABLE: it reads its own address, which is
 * also the value of r[15] in accesses. */
COMPUTATION(set_pc, core->r[15] = insn->address)

/* After an instruction that has written SP or PC. */
COMPUTATION(align_sp, core->r[13] &= ~3u)

OPERATION(go_to_pc) {
  const Insn *next = at_address(core, core->r[15] & ~1u);
  TAIL enter(core, next, budget);
}

OPERATION(undefined) { stop_on(core, insn, budget, STOP_UNDEFINED); }

/* -- writing --------------------------------------------------------------------------------------------- */

/* The output position and state of the block builder. */
typedef struct {
  Core *core;
  const Memory *memory;
  Insn *at;
  uint32_t address;
  uint8_t it;
} Writer;

static Insn *put(Writer *writer, Operation run) {
  *writer->at = (Insn){.run = run, .address = writer->address, .it = writer->it};
  return writer->at++;
}

static void put_link(Writer *writer, uint32_t address) {
  Insn *link = put(writer, link_up);
  link->address = address;
  link->next = link;
}

static Insn decoded(const Core *core, const Memory *memory, uint32_t address, uint8_t it) {
  uint32_t offset = address - memory->base;
  uint16_t first = 0, second = 0;
  memcpy(&first, memory->bytes + offset, 2);
  if (offset + 4 <= memory->size) {
    memcpy(&second, memory->bytes + offset + 2, 2);
  }
  Insn insn = {.address = address, .it = it, .left = 1};
  if (!(first >> 11 >= 0x1D ? decode32(address, first, second, &insn) : decode16(address, first, &insn))) {
    insn = (Insn){.run = undefined, .address = address, .it = it, .left = 1, .kind = ENDS};
  }
  if (!core->fpu_on && is_floating_point(first, second)) {
    insn = (Insn){.run = no_coprocessor, .address = address, .it = it, .left = 1, .kind = ENDS};
  }
  bool has_core_registers = (first & 0xEC00) != 0xEC00; /* else those of the floating-point unit */
  if (has_core_registers && (insn.d == 15 || insn.n == 15 || insn.m == 15 || insn.a == 15)) {
    insn.kind |= READS_PC;
  }
  return insn;
}

/* Add the instruction without its condition. */
static void put_insn(Writer *writer, Insn insn) {
  const Memory *memory = writer->memory;
  uint32_t offset = insn.imm - memory->base;
  if (insn.kind & READS_PC) {
    put(writer, set_pc);
  }
  if (insn.kind & LITERAL && memory->size >= 4 && offset <= memory->size - 4 && !writer->core->watches) {
    make_literal(&insn, memory->bytes + offset);
  }
  *writer->at++ = insn;
  if (insn.kind & WRITES_SP) {
    put(writer, insn.kind & ENDS ? go_to_pc : align_sp);
  }
}

/* Add the links after the last instruction of the block. */
static void put_links(Writer *writer, const Insn *last) {
  put_link(writer, writer->address);
  if (last->kind & LINKS) {
    put_link(writer, last->imm);
  }
}

/* Add the condition of the next instruction of an IT block; at the first one IT itself can be the condition. */
static Insn *put_condition(Writer *writer) {
  Insn *before = writer->at - 1;
  Insn *condition = before->kind & IS_IT ? before : put(writer, NULL);
  condition->run = unless(writer->it >> 4);
  return condition;
}

/* Add an instruction that checks core->mask, which is already set, or is set before it (at the first one by IT
 * itself). */
static void put_masked(Writer *writer, Insn insn) {
  Insn *before = writer->at - 1;
  if (before->kind & IS_IT) {
    before->run = set_mask(insn.it >> 4);
  } else if (!(before->kind & MASKED)) {
    put(writer, set_mask(insn.it >> 4));
  }
  *writer->at++ = insn;
}

static void mark(Writer *writer) {
  const Memory *memory = writer->memory;
  uint32_t begin = writer->address - memory->base, end = address_after(memory, writer->address) - memory->base;
  for (uint32_t at = begin; at < end && at < memory->size; at += 2) {
    memory->marks[at >> 1] |= DECODED;
  }
  if (memory->writable) {
    writer->core->slow_stores |= STORES_CHANGE_CODE;
    core_choose_plain(writer->core);
  }
}

/* Add the next instruction of a block; false if it was the last one. */
static bool put_next(Writer *writer, bool is_first, bool may_go_on) {
  const Memory *memory = writer->memory;
  if (writer->address - memory->base >= memory->size || (!is_first && is_breakpoint(memory, writer->address))) {
    put(writer, to_loop);
    return false;
  }
  Insn insn = decoded(writer->core, memory, writer->address, writer->it), *condition = NULL;
  bool rest_of_it = it_advance(writer->it);
  if (rest_of_it && insn.kind & ENDS) { /* UNPREDICTABLE for branches; rare for other instructions */
    put(writer, to_loop);
    return false;
  }
  mark(writer);
  if (insn.kind & MASKED) {
    put_masked(writer, insn);
  } else {
    if (writer->it && !(insn.kind & ALWAYS)) {
      condition = put_condition(writer);
    }
    put_insn(writer, insn);
    if (condition) {
      condition->by = (uint8_t)(writer->at - condition);
    }
  }
  writer->address = address_after(memory, writer->address);
  writer->it = (uint8_t)(insn.kind & IS_IT ? insn.imm : it_advance(writer->it));
  if (insn.kind & ENDS || (!may_go_on && !writer->it)) {
    put_links(writer, &insn);
    return false;
  }
  return true;
}

static Insn *written(Core *core, const Memory *memory, uint32_t address, Insn *first) {
  Writer writer = {core, memory, first, address, 0};
  for (unsigned count = 1; put_next(&writer, count == 1, count < LONGEST); count++) {
  }
  for (Insn *insn = writer.at - 2; insn >= first; insn--) {
    insn->left = (uint8_t)(insn->left + insn[1].left);
  }
  return writer.at;
}

/* -- discarding ------------------------------------------------------------------------------------------ */

static Memory *memory_at(Core *core, uint32_t address) {
  for (Memory *memory = core->memory; memory < core->memory + MEMORIES; memory++) {
    if (address - memory->base < memory->size) {
      return memory;
    }
  }
  return NULL;
}

/* End the current chain, if there is one, after the current instruction. */
static void forget_all(Core *core) {
  DecodeCache *blocks = core->blocks;
  int64_t work = WORK_DECODE * (int64_t)blocks->used;
  core->chip->work += work;
  core->chip->costs.instructions.work += work;
  for (const Insn *insn = blocks->insns + 1; insn < blocks->insns + blocks->used; insn++) {
    Memory *memory = memory_at(core, insn->address);
    if (memory) {
      uint32_t slot = (insn->address - memory->base) >> 1;
      memory->heads[slot] = 0;
      memory->marks[slot] &= BREAKPOINT;
      if (slot + 1 < memory->size / 2) {
        memory->marks[slot + 1] &= BREAKPOINT;
      }
    }
  }
  blocks->used = 1;
  core->bound = 0;
  core->unlinked = NULL;
  core->slow_stores &= ~(uint32_t)STORES_CHANGE_CODE;
  core_choose_plain(core);
}

void core_forget_code(Core *core, uint32_t address, uint32_t size) {
  const Memory *memory = memory_at(core, address);
  uint32_t offset = memory ? address - memory->base : 0;
  bool one_by_one = memory && size <= 8 && size <= memory->size - offset, is_decoded = !one_by_one;
  for (uint32_t at = offset; one_by_one && at < offset + size; at++) {
    is_decoded |= memory->marks[at >> 1] & DECODED;
  }
  if (is_decoded && core->blocks->used > 1) {
    forget_all(core);
  }
}

void fcu_forget_code(Chip *chip) { core_forget_code(&chip->core, FLASH_BASE, UINT32_MAX); }

void fcu_set_breakpoint(Chip *chip, uint32_t address, int32_t on) {
  Memory *memory = memory_at(&chip->core, address);
  if (memory) {
    core_forget_code(&chip->core, address, 1);
    uint8_t *marks = &memory->marks[(address - memory->base) >> 1];
    *marks = (uint8_t)(on ? *marks | BREAKPOINT : *marks & ~BREAKPOINT);
  }
}

/* -- the interface for the loop -------------------------------------------------------------------------- */

const Insn *decode_cache_at(Core *core, const Memory *memory, uint32_t address) {
  DecodeCache *blocks = core->blocks;
  uint32_t *head = &memory->heads[(address - memory->base) >> 1];
  if (!*head) {
    if (blocks->used > CAPACITY - ROOM) {
      forget_all(core);
    }
    Insn *first = blocks->insns + blocks->used;
    blocks->used = (uint32_t)(written(core, memory, address, first) - blocks->insns);
    *head = (uint32_t)((uint8_t *)first - (uint8_t *)blocks->insns);
  }
  const Insn *block = (const Insn *)((const uint8_t *)blocks->insns + *head);
  Insn *link = (Insn *)core->unlinked;
  if (link && link->address == address) {
    link->next = block;
    link->run = go;
  }
  core->unlinked = NULL;
  return block;
}

const Insn *decode_cache_part(Core *core, const Insn *block, unsigned count) {
  Insn *part = core->blocks->part;
  unsigned most = block->left - count; /* the minimum number of instructions left out */
  const Insn *rest = block;
  for (const Insn *insn = block + 1; insn->left >= most; insn++) {
    bool begins = insn->address != insn[-1].address && !insn->it;
    rest = begins ? insn : rest;
  }
  if (rest == block) {
    return NULL;
  }
  size_t length = (size_t)(rest - block);
  memcpy(part, block, length * sizeof *part);
  for (size_t n = 0; n < length; n++) {
    part[n].left = (uint8_t)(part[n].left - rest->left);
  }
  part[length] = (Insn){.run = to_loop, .address = rest->address};
  return part;
}

const Insn *decode_cache_single(Core *core, const Memory *memory, uint32_t address) {
  Insn *single = core->blocks->single;
  Writer writer = {core, memory, single, address, (uint8_t)core->itstate};
  Insn insn = decoded(core, memory, address, writer.it);
  put_insn(&writer, insn);
  writer.address = address_after(memory, address);
  put_links(&writer, &insn);
  return single;
}

/* -- creation -------------------------------------------------------------------------------------------- */

bool decode_cache_create(Core *core) {
  core->blocks = calloc(1, sizeof(DecodeCache));
  if (!core->blocks) {
    return false;
  }
  core->blocks->used = 1;
  core->insns = core->blocks->insns;
  return true;
}

void decode_cache_destroy(Core *core) { free(core->blocks); }
