/* How one operation calls the next (threaded code).
 *
 * An operation ends with a call of the next instruction's operation, which the compiler turns into a jump. A
 * processor predicts the target of a jump by the jump's address, so one common jump in a loop would be predicted
 * badly. The next operation needs only its arguments, which stay in registers of the host: core, insn, and budget.
 *
 * Instructions are counted once per block, at its entry: budget is how many may still begin after the whole block.
 * core->counter and r[15] are therefore outdated inside a chain. core->end is counter plus budget; insn->left is how
 * many instructions of the block were counted in advance. look_outside() updates them before accesses outside of
 * plain memory and at the end of the chain. core->itstate is 0 in a chain; insn->it has its value.
 *
 * A block that needs more than the budget is not entered: the loop in run_loop.c executes as many of its
 * instructions as the limit allows. The budget of a chain is at most some hundred instructions, because a compiler
 * may turn the jumps into calls.
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

#define OPERATION(name)                                                                           \
  static void name(Core *core __attribute__((unused)), const Insn *insn __attribute__((unused)),  \
                   int32_t budget __attribute__((unused)))
/* An operation that only computes and continues. */
#define COMPUTATION(name, ...)  \
  OPERATION(name) {             \
    __VA_ARGS__;                \
    NEXT;                       \
  }
/* A rare case: it must not use registers of the operations that lead to it. */
#define SLOW_OPERATION(name) __attribute__((noinline, cold)) OPERATION(name)
#define INLINE static inline __attribute__((always_inline))

/* The end of an operation: continue with the next instruction of the block. */
#define NEXT TAIL insn[1].run(core, insn + 1, budget)

/* Update counter and r[15]: from here on other code may read the core's state. */
INLINE void sync_state(Core *core, const Insn *insn, int32_t budget) {
  core->counter = core->chain_end - (uint64_t)(int64_t)budget - insn->remaining + 1;
  core->r[15] = insn->address;
  core->itstate = insn->it;
}

/* Return to the loop, which continues at the address. */
INLINE void exit_chain(Core *core, uint32_t address, int32_t budget) {
  core->counter = core->chain_end - (uint64_t)(int64_t)budget;
  core->r[15] = address;
}

/* Continue with the step at the beginning of a block; an unresolved link uses no budget. */
INLINE void enter_block(Core *core, const Insn *insn, int32_t budget) {
  if (LIKELY(insn->remaining <= budget)) {
    TAIL insn->run(core, insn, budget - insn->remaining);
  }
  exit_chain(core, insn->address, budget);
}

/* After look_outside(): continue with the instruction after the executed one. */
static inline void resume_chain(Core *core, const Insn *insn) {
  const Insn *next = insn + 1;
  uint64_t end = core->limit < core->chain_limit ? core->limit : core->chain_limit;
  if (LIKELY(core->stop == STOP_SLICE && core->counter + next->remaining <= end)) {
    core->chain_end = end;
    core->itstate = 0;
    next->run(core, next, (int32_t)(end - core->counter) - next->remaining);
  } else {
    core->r[15] = next->address;
    core->itstate = next->it;
  }
}

/* The same for a branch, to its target. */
static inline void resume_chain_at(Core *core, const Insn *next) {
  uint64_t end = core->limit < core->chain_limit ? core->limit : core->chain_limit;
  core->chain_end = end > core->counter ? end : core->counter;
  core->itstate = 0;
  enter_block(core, next, (int32_t)(core->chain_end - core->counter));
}

/* End the run on this instruction, with a reason. */
static inline void stop_at(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  sync_state(core, insn, budget);
  core->stop = why;
  core->limit = core->counter;
}

/* End the run after this instruction, with a reason. */
static inline void stop_after(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  stop_at(core, insn, budget, why);
  core->r[15] = insn[1].address;
  core->itstate = it_advance(insn->it);
}

/* -- the target of a branch, for enter() ----------------------------------------------------------------- */

/* Instructions without an address: run_loop.c. The loop continues at r[15], or the run ends with EXCEPTION_RETURN. */
extern const Insn exit_to_loop, exception_return;

/* Continue at a computed, even address. */
INLINE const Insn *block_at(Core *core, uint32_t target) {
  uint32_t offset = target - core->code.base;
  if (LIKELY(offset < core->code.size)) {
    uint32_t head = core->code.blocks[offset >> 1];
    if (LIKELY(head)) {
      return (const Insn *)((const char *)core->insns + head);
    }
  }
  core->r[15] = target;
  return &exit_to_loop;
}

/* BLXWritePC (A2.3.1). */
INLINE const Insn *blx_write_pc(Core *core, uint32_t target) {
  if (LIKELY(target & 1)) {
    return block_at(core, target - 1);
  }
  core->thumb = 0;
  core->r[15] = target;
  return &exit_to_loop;
}

/* BXWritePC (A2.3.1): also LDR, LDM and POP of PC. */
INLINE const Insn *bx_write_pc(Core *core, uint32_t target) {
  if (UNLIKELY(target >> 28 == 0xF && in_handler(core))) {
    core->r[15] = target & ~1u;
    return &exception_return;
  }
  return blx_write_pc(core, target);
}

#endif
