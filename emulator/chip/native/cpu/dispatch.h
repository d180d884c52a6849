/* How operations follow each other.
 *
 * An operation ends by calling that of the next instruction: in optimised code a jump, and a processor predicts
 * where a jump goes by the place it is made from, badly if all are made from one loop. What the next one needs
 * is in the arguments, which stay in the host's registers: core, insn, and budget.
 *
 * Instructions are counted once a block, when it is entered: budget is how many may still be begun after the
 * whole block. So core->counter and r[15] are not up to date while operations follow each other: core->end is
 * counter and budget together, and insn->left how many instructions of the block were counted in advance. Where
 * anybody may look, in accesses outside of plain memory and where the chain ends, look_outside() puts them right.
 * core->itstate is 0 meanwhile; insn->it is what it would be.
 *
 * A block that needs more than the budget is not entered: the loop in run_loop.c executes what the limit allows of
 * it. The budget of a chain is at most some hundred instructions, because a compiler may make calls of the jumps.
 */
#ifndef FCU_DISPATCH_H
#define FCU_DISPATCH_H

#include "cpu/core.h"

#if defined(__has_attribute) && !defined(__wasm__)
#if __has_attribute(musttail)
#define TAIL __attribute__((musttail)) return
#endif
#endif
#ifndef TAIL
#define TAIL return
#endif

#define OPERATION(name)                                                                                  \
  static void name(Core *core __attribute__((unused)), const Insn *insn __attribute__((unused)),         \
                   int32_t budget __attribute__((unused)))
/* One that does no more than that. */
#define COMPUTATION(name, ...)  \
  OPERATION(name) {             \
    __VA_ARGS__;                \
    NEXT;                       \
  }
/* Not on the usual way: it must not cost the operations that lead to it any registers. */
#define RARE_OPERATION(name) __attribute__((noinline, cold)) OPERATION(name)
#define INLINE static inline __attribute__((always_inline))

/* The last thing of an operation: the next instruction of the block. */
#define NEXT TAIL insn[1].run(core, insn + 1, budget)

/* Everybody may look from here on. */
INLINE void look_outside(Core *core, const Insn *insn, int32_t budget) {
  core->counter = core->end - (uint64_t)(int64_t)budget - insn->left + 1;
  core->r[15] = insn->address;
  core->itstate = insn->it;
}

/* Back to the loop, which goes on at the address. */
INLINE void leave_chain(Core *core, uint32_t address, int32_t budget) {
  core->counter = core->end - (uint64_t)(int64_t)budget;
  core->r[15] = address;
}

/* Go on with a block, or rather what is at its beginning; a link that leads nowhere yet takes nothing. */
INLINE void enter(Core *core, const Insn *insn, int32_t budget) {
  if (LIKELY(insn->left <= budget)) {
    TAIL insn->run(core, insn, budget - insn->left);
  }
  leave_chain(core, insn->address, budget);
}

/* After look_outside(), when the instruction has been executed. */
static inline void go_on(Core *core, const Insn *insn) {
  const Insn *next = insn + 1;
  uint64_t end = core->limit < core->bound ? core->limit : core->bound;
  if (LIKELY(core->stop == STOP_SLICE && core->counter + next->left <= end)) {
    core->end = end;
    core->itstate = 0;
    next->run(core, next, (int32_t)(end - core->counter) - next->left);
  } else {
    core->r[15] = next->address;
    core->itstate = next->it;
  }
}

/* The same of a branch, with what says where it goes. */
static inline void go_on_at(Core *core, const Insn *next) {
  uint64_t end = core->limit < core->bound ? core->limit : core->bound;
  core->end = end > core->counter ? end : core->counter;
  core->itstate = 0;
  enter(core, next, (int32_t)(core->end - core->counter));
}

/* The run ends on this instruction, for a reason. */
static inline void stop_on(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  look_outside(core, insn, budget);
  core->stop = why;
  core->limit = core->counter;
}

/* The run ends after this instruction. */
static inline void stop_after(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  stop_on(core, insn, budget, why);
  core->r[15] = insn[1].address;
  core->itstate = it_advance(insn->it);
}

/* -- where a branch goes: what enter() takes ------------------------------------------------------------- */

/* Instructions of no address: run_loop.c. The loop goes on at r[15], or the run ends with EXCEPTION_RETURN. */
extern const Insn elsewhere, exception_return;

/* To an address that was computed. It is even. */
INLINE const Insn *at_address(Core *core, uint32_t target) {
  uint32_t offset = target - core->code.base;
  if (LIKELY(offset < core->code.size)) {
    uint32_t head = core->code.heads[offset >> 1];
    if (LIKELY(head)) {
      return (const Insn *)((const char *)core->insns + head);
    }
  }
  core->r[15] = target;
  return &elsewhere;
}

/* BLXWritePC (A2.3.1). */
INLINE const Insn *interworking(Core *core, uint32_t target) {
  if (LIKELY(target & 1)) {
    return at_address(core, target - 1);
  }
  core->thumb = 0;
  core->r[15] = target;
  return &elsewhere;
}

/* BXWritePC (A2.3.1): also LDR, LDM and POP of PC. */
INLINE const Insn *exchange(Core *core, uint32_t target) {
  if (UNLIKELY(target >> 28 == 0xF && in_handler(core))) {
    core->r[15] = target & ~1u;
    return &exception_return;
  }
  return interworking(core, target);
}

#endif
