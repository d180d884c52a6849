/* Branches, IT, SVC, BKPT (ARMv7-M ARM A5.2.5, A5.2.6, A5.3.4). imm: target of a branch. */
#include "cpu/control.h"

#include "cpu/system.h"

/* Two links follow a branch (decode_cache.h). */
#define FOLLOWING insn[1].next
#define TARGET insn[2].next

OPERATION(b) { TAIL enter_block(core, TARGET, budget); }

/* Even conditions (A7.3.1); each odd condition is the inverse of the even one. */
INLINE bool is_eq(const Core *core) { return core->z == 0; }
INLINE bool is_cs(const Core *core) { return core->c; }
INLINE bool is_mi(const Core *core) { return core->n >> 31; }
INLINE bool is_vs(const Core *core) { return core->v >> 31; }
INLINE bool is_hi(const Core *core) { return core->c && core->z != 0; }
INLINE bool is_ge(const Core *core) { return !((core->n ^ core->v) >> 31); }
INLINE bool is_gt(const Core *core) { return core->z != 0 && is_ge(core); }

#define EACH_CONDITION(DEFINE)                                                                       \
  DEFINE(eq, is_eq(core)) DEFINE(ne, !is_eq(core)) DEFINE(cs, is_cs(core)) DEFINE(cc, !is_cs(core))  \
  DEFINE(mi, is_mi(core)) DEFINE(pl, !is_mi(core)) DEFINE(vs, is_vs(core)) DEFINE(vc, !is_vs(core))  \
  DEFINE(hi, is_hi(core)) DEFINE(ls, !is_hi(core)) DEFINE(ge, is_ge(core)) DEFINE(lt, !is_ge(core))  \
  DEFINE(gt, is_gt(core)) DEFINE(le, !is_gt(core))

#define DEFINE_BRANCH(name, condition)          \
  OPERATION(b##name) {                          \
    if (condition) {                            \
      TAIL enter_block(core, TARGET, budget);   \
    }                                           \
    TAIL enter_block(core, FOLLOWING, budget);  \
  }
EACH_CONDITION(DEFINE_BRANCH)

#define BRANCH(name, condition) b##name,
static const Operation branches[14] = {EACH_CONDITION(BRANCH)};

OPERATION(bl) {
  core->r[14] = insn[1].address | 1;
  TAIL enter_block(core, TARGET, budget);
}

OPERATION(bx) {
  const Insn *next = bx_write_pc(core, core->r[insn->m]);
  TAIL enter_block(core, next, budget);
}

/* BX PC branches to an address whose bit 0 is 0, which selects the ARM state. The chip does not have this
 * state, so the next fetch faults. */
OPERATION(bx_pc) {
  const Insn *next = bx_write_pc(core, insn->imm);
  TAIL enter_block(core, next, budget);
}

/* BLXWritePC (A2.3.1): BLX cannot return from an exception. */
OPERATION(blx) {
  const Insn *next = blx_write_pc(core, core->r[insn->m]);
  core->r[14] = insn[1].address | 1;
  TAIL enter_block(core, next, budget);
}

OPERATION(cbz) {
  if (core->r[insn->n] == 0) {
    TAIL enter_block(core, TARGET, budget);
  }
  TAIL enter_block(core, FOLLOWING, budget);
}

OPERATION(cbnz) {
  if (core->r[insn->n] != 0) {
    TAIL enter_block(core, TARGET, budget);
  }
  TAIL enter_block(core, FOLLOWING, budget);
}

static bool decode_branch(Operation run, uint32_t target, Insn *insn) {
  insn->run = run;
  insn->imm = target;
  insn->flags |= ENDS_BLOCK | DIRECT_BRANCH;
  return true;
}

static bool decode_exchange(uint32_t address, uint16_t first, Insn *insn) {
  bool links = bits(first, 7, 7);
  insn->m = bits(first, 6, 3);
  insn->imm = address + 4;
  insn->flags |= ENDS_BLOCK;
  insn->run = links ? blx : insn->m == 15 ? bx_pc : bx;
  return bits(first, 2, 0) == 0;
}

/* -- IT ------------------------------------------------------------------------------------------------
 * decode_cache.c inserts the conditions. If the condition fails, the instruction is skipped; it takes a cycle
 * (Cortex-M4 TRM 3.3.1) and is counted. */

#define DEFINE_SKIP_UNLESS(name, condition)  \
  OPERATION(skip_unless_##name) {            \
    if (condition) {                         \
      NEXT;                                  \
    }                                        \
    insn += insn->shift;                     \
    TAIL insn->run(core, insn, budget);      \
  }
EACH_CONDITION(DEFINE_SKIP_UNLESS)

#define SKIP_UNLESS(name, condition) skip_unless_##name,

Operation skip_unless(unsigned condition) {
  static const Operation operations[14] = {EACH_CONDITION(SKIP_UNLESS)};
  return condition < 14 ? operations[condition] : nop;
}

#define DEFINE_MASK(name) COMPUTATION(mask_##name, core->it_mask = -(uint32_t)is_##name(core))
DEFINE_MASK(eq)
DEFINE_MASK(cs)
DEFINE_MASK(mi)
DEFINE_MASK(vs)
DEFINE_MASK(hi)
DEFINE_MASK(ge)
DEFINE_MASK(gt)
COMPUTATION(mask_al, core->it_mask = -1u)

Operation mask_operation(unsigned condition) {
  static const Operation operations[] = {mask_eq, mask_cs, mask_mi, mask_vs, mask_hi, mask_ge, mask_gt, mask_al};
  return operations[condition >> 1];
}

/* A7.7.38; IT inside an IT block is UNPREDICTABLE. */
static bool decode_it(uint32_t itstate, Insn *insn) {
  insn->run = nop;
  insn->imm = itstate;
  insn->flags |= IS_IT;
  return !insn->it;
}

OPERATION(svc) { stop_after(core, insn, budget, STOP_SVC); }

OPERATION(bkpt) { stop_at(core, insn, budget, STOP_BKPT); }

/* Section A5.2.5. */
static bool decode_miscellaneous(uint32_t address, uint16_t first, Insn *insn) {
  if ((first & 0xF500) == 0xB100) {
    insn->n = bits(first, 2, 0);
    uint32_t distance = bits(first, 9, 9) << 6 | bits(first, 7, 3) << 1;
    return decode_branch(bits(first, 11, 11) ? cbnz : cbz, address + 4 + distance, insn);
  }
  if (first >> 5 == 0xB660 >> 5) {
    return decode_cps(first, insn);
  }
  switch (first >> 8) {
  case 0xBE:
    insn->run = bkpt;
    insn->flags |= ENDS_BLOCK | UNCONDITIONAL;
    return true;
  case 0xBF:
    if (bits(first, 3, 0) == 0) {
      return decode_hint(bits(first, 7, 4), insn);
    }
    return decode_it(bits(first, 7, 0), insn);
  default: return false;
  }
}

bool decode_control16(uint32_t address, uint16_t first, Insn *insn) {
  unsigned condition = bits(first, 11, 8);
  switch (first >> 12) {
  case 4: return decode_exchange(address, first, insn);
  case 0xB: return decode_miscellaneous(address, first, insn);
  case 0xD:
    if (condition < 14) {
      return decode_branch(branches[condition], address + 4 + 2 * (uint32_t)sign_extend(first, 8), insn);
    }
    insn->run = svc;
    insn->flags |= ENDS_BLOCK;
    return condition == 15;
  case 0xE: return decode_branch(b, address + 4 + 2 * (uint32_t)sign_extend(first, 11), insn);
  default: return false;
  }
}

/* Section A5.3.4. */
bool decode_control32(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  uint32_t s = bits(first, 10, 10), j1 = bits(second, 13, 13), j2 = bits(second, 11, 11);
  uint32_t low = bits(second, 10, 0), pc = address + 4;
  unsigned condition = bits(first, 9, 6);
  if (bits(second, 12, 12)) { /* encoding T4 (A7.7.12) */
    uint32_t offset = s << 23 | (j1 ^ s ^ 1) << 22 | (j2 ^ s ^ 1) << 21 | bits(first, 9, 0) << 11 | low;
    return decode_branch(bits(second, 14, 14) ? bl : b, pc + 2 * (uint32_t)sign_extend(offset, 24), insn);
  }
  if (bits(second, 14, 14)) {
    return false;
  }
  if (condition < 14) { /* encoding T3 */
    uint32_t offset = s << 19 | j2 << 18 | j1 << 17 | bits(first, 5, 0) << 11 | low;
    return decode_branch(branches[condition], pc + 2 * (uint32_t)sign_extend(offset, 20), insn);
  }
  return decode_system32(first, second, insn);
}
