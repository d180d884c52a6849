/* Threaded code: an operation ends with a call of the next operation. The compiler turns this call into a jump.
 * A single jump in a loop, shared by all operations, would be predicted badly. The arguments stay in host registers.
 *
 * Instructions are counted when a block is entered: budget is the number of instructions that may begin after
 * this block. Inside a chain itstate is 0, and counter and r[15] are outdated until sync_state() updates them.
 * core->chain_end is counter + budget; insn->remaining instructions were counted in advance. run_loop.c divides
 * a block that exceeds the budget. The budget is at most MAX_CHAIN, because a compiler may keep the calls,
 * and calls use stack.
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
#define COMPUTATION(name, ...)  \
  OPERATION(name) {             \
    __VA_ARGS__;                \
    NEXT;                       \
  }
/* Slow paths are separate functions, so that fast paths do not save registers for them. */
#define SLOW_OPERATION(name) __attribute__((noinline, cold)) OPERATION(name)
#define INLINE static inline __attribute__((always_inline))

#define NEXT TAIL insn[1].run(core, insn + 1, budget)

/* Update counter and r[15], so that other code may read the state. */
INLINE void sync_state(Core *core, const Insn *insn, int32_t budget) {
  core->counter = core->chain_end - (uint64_t)(int64_t)budget - insn->remaining + 1;
  core->r[15] = insn->address;
  core->itstate = insn->it;
}

INLINE void exit_chain(Core *core, uint32_t address, int32_t budget) {
  core->counter = core->chain_end - (uint64_t)(int64_t)budget;
  core->r[15] = address;
}

/* A block begins only if the budget covers all its instructions. An unresolved link has no instructions,
 * so it always runs. */
INLINE void enter_block(Core *core, const Insn *insn, int32_t budget) {
  if (LIKELY(insn->remaining <= budget)) {
    TAIL insn->run(core, insn, budget - insn->remaining);
  }
  exit_chain(core, insn->address, budget);
}

/* Continue after the executed instruction. The caller has called sync_state(). */
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

static inline void resume_chain_at(Core *core, const Insn *next) {
  uint64_t end = core->limit < core->chain_limit ? core->limit : core->chain_limit;
  core->chain_end = end > core->counter ? end : core->counter;
  core->itstate = 0;
  enter_block(core, next, (int32_t)(core->chain_end - core->counter));
}

static inline void stop_at(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  sync_state(core, insn, budget);
  core->stop = why;
  core->limit = core->counter;
}

static inline void stop_after(Core *core, const Insn *insn, int32_t budget, enum Stop why) {
  stop_at(core, insn, budget, why);
  core->r[15] = insn[1].address;
  core->itstate = it_advance(insn->it);
}

/* -- branch targets, for enter_block() ---------------------------------------------------------------- */

/* exit_to_loop returns to the main loop, which continues at r[15]. exception_return ends the run with
 * EXCEPTION_RETURN (run_loop.c). */
extern const Insn exit_to_loop, exception_return;

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

INLINE const Insn *blx_write_pc(Core *core, uint32_t target) {
  if (LIKELY(target & 1)) {
    return block_at(core, target - 1);
  }
  core->thumb = 0;
  core->r[15] = target;
  return &exit_to_loop;
}

/* BXWritePC (A2.3.1), also for LDR, LDM and POP. */
INLINE const Insn *bx_write_pc(Core *core, uint32_t target) {
  if (UNLIKELY(target >> 28 == 0xF && in_handler(core))) {
    core->r[15] = target & ~1u;
    return &exception_return;
  }
  return blx_write_pc(core, target);
}

#endif
