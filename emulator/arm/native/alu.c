/* AND to CMP with each kind of second operand (ARMv7-M ARM A5.3.1, A5.3.11).
 *
 * One function for each combination, so that none has to find out what it is while it runs; macros make them.
 * Each reads what it needs before it writes: d may be n or m.
 */
#include "operations.h"

#define INLINE static inline __attribute__((always_inline))

/* -- the second operand, and the carry out of its shifter (Shift_C, A7.4.2) ----------------------------- */

INLINE uint32_t by_lsl(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  *carry = m >> (32 - insn->by) & 1;
  return m << insn->by;
}

INLINE uint32_t by_lsr(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m] >> (insn->by - 1);
  *carry = m & 1;
  return m >> 1;
}

INLINE uint32_t by_asr(const Core *core, const Insn *insn, uint32_t *carry) {
  int32_t m = (int32_t)core->r[insn->m] >> (insn->by - 1);
  *carry = m & 1;
  return (uint32_t)(m >> 1);
}

INLINE uint32_t by_ror(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  uint32_t result = m >> insn->by | m << (32 - insn->by);
  *carry = result >> 31;
  return result;
}

INLINE uint32_t by_rrx(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  *carry = m & 1;
  return core->c << 31 | m >> 1;
}

INLINE uint32_t plain(const Core *core, const Insn *insn, uint32_t *carry) {
  *carry = core->c;
  return core->r[insn->m];
}

INLINE uint32_t constant(const Core *core, const Insn *insn, uint32_t *carry) {
  *carry = core->c;
  return insn->imm;
}

INLINE uint32_t rotated_constant(const Core *core, const Insn *insn, uint32_t *carry) {
  (void)core;
  *carry = insn->imm >> 31;
  return insn->imm;
}

#define EACH_OPERAND(DEFINE, ...)     \
  DEFINE(by_lsl, __VA_ARGS__)         \
  DEFINE(by_lsr, __VA_ARGS__)         \
  DEFINE(by_asr, __VA_ARGS__)         \
  DEFINE(by_ror, __VA_ARGS__)         \
  DEFINE(by_rrx, __VA_ARGS__)         \
  DEFINE(plain, __VA_ARGS__)          \
  DEFINE(constant, __VA_ARGS__)       \
  DEFINE(rotated_constant, __VA_ARGS__)

/* -- the operations ------------------------------------------------------------------------------------- */

/* AddWithCarry (A2.2.1), with the flags. */
INLINE uint32_t add_with_carry(Core *core, uint32_t x, uint32_t y, uint32_t carry_in) {
  uint64_t sum = (uint64_t)x + y + carry_in;
  uint32_t result = (uint32_t)sum;
  core->c = (uint32_t)(sum >> 32);
  core->v = ((x ^ result) & (y ^ result)) >> 31;
  set_nz(core, result);
  return result;
}

#define FETCH(operand)                         \
  uint32_t carry;                              \
  uint32_t m = operand(core, insn, &carry);    \
  uint32_t n = core->r[insn->n];               \
  (void)carry, (void)n

#define DEFINE_LOGICAL(operand, name, result)                           \
  static void name##_##operand(Core *core, const Insn *insn) {          \
    FETCH(operand);                                                     \
    core->r[insn->d] = (result);                                        \
    execute_next(core, insn);                                           \
  }                                                                     \
  static void name##s_##operand(Core *core, const Insn *insn) {         \
    FETCH(operand);                                                     \
    uint32_t written = (result);                                        \
    core->r[insn->d] = written;                                         \
    core->c = carry;                                                    \
    set_nz(core, written);                                              \
    execute_next(core, insn);                                           \
  }
EACH_OPERAND(DEFINE_LOGICAL, and, n & m)
EACH_OPERAND(DEFINE_LOGICAL, bic, n & ~m)
EACH_OPERAND(DEFINE_LOGICAL, orr, n | m)
EACH_OPERAND(DEFINE_LOGICAL, orn, n | ~m)
EACH_OPERAND(DEFINE_LOGICAL, eor, n ^ m)
EACH_OPERAND(DEFINE_LOGICAL, mov, m)
EACH_OPERAND(DEFINE_LOGICAL, mvn, ~m)

#define DEFINE_ARITHMETIC(operand, name, x, y, carry_in)                \
  static void name##_##operand(Core *core, const Insn *insn) {          \
    FETCH(operand);                                                     \
    core->r[insn->d] = (x) + (y) + (carry_in);                          \
    execute_next(core, insn);                                           \
  }                                                                     \
  static void name##s_##operand(Core *core, const Insn *insn) {         \
    FETCH(operand);                                                     \
    unsigned d = insn->d;                                               \
    core->r[d] = add_with_carry(core, x, y, carry_in);                  \
    execute_next(core, insn);                                           \
  }
EACH_OPERAND(DEFINE_ARITHMETIC, add, n, m, 0)
EACH_OPERAND(DEFINE_ARITHMETIC, adc, n, m, core->c)
EACH_OPERAND(DEFINE_ARITHMETIC, sbc, n, ~m, core->c)
EACH_OPERAND(DEFINE_ARITHMETIC, sub, n, ~m, 1)
EACH_OPERAND(DEFINE_ARITHMETIC, rsb, m, ~n, 1)

#define DEFINE_TEST(operand, name, result)                              \
  static void name##_##operand(Core *core, const Insn *insn) {          \
    FETCH(operand);                                                     \
    core->c = carry;                                                    \
    set_nz(core, result);                                               \
    execute_next(core, insn);                                           \
  }
EACH_OPERAND(DEFINE_TEST, tst, n & m)
EACH_OPERAND(DEFINE_TEST, teq, n ^ m)

#define DEFINE_COMPARISON(operand, name, y, carry_in)                   \
  static void name##_##operand(Core *core, const Insn *insn) {          \
    FETCH(operand);                                                     \
    add_with_carry(core, n, y, carry_in);                               \
    execute_next(core, insn);                                           \
  }
EACH_OPERAND(DEFINE_COMPARISON, cmn, m, 0)
EACH_OPERAND(DEFINE_COMPARISON, cmp, ~m, 1)

/* -- the choice ----------------------------------------------------------------------------------------- */

#define ENTRY(operand, name) name##_##operand,
#define ROW(name) {EACH_OPERAND(ENTRY, name)}
#define BOTH(name) {ROW(name), ROW(name##s)}

/* By enum Alu, whether it sets flags, and enum Operand. */
static const Operation operations[ALUS][2][OPERANDS] = {
    [AND] = BOTH(and), [BIC] = BOTH(bic), [ORR] = BOTH(orr), [ORN] = BOTH(orn),
    [EOR] = BOTH(eor), [ADD] = BOTH(add), [ADC] = BOTH(adc), [SBC] = BOTH(sbc),
    [SUB] = BOTH(sub), [RSB] = BOTH(rsb), [MOV] = BOTH(mov), [MVN] = BOTH(mvn),
    [TST] = {ROW(tst), ROW(tst)}, [TEQ] = {ROW(teq), ROW(teq)},
    [CMN] = {ROW(cmn), ROW(cmn)}, [CMP] = {ROW(cmp), ROW(cmp)},
};

/* The low bits of SP and PC are 0 whatever is written (B1.4.1; BranchWritePC, A2.3.1). insn->flags: enum Alu
 * and whether it sets flags; insn->shift: enum Operand. */
static void into_sp_or_pc(Core *core, const Insn *insn) {
  core->ahead = 0; /* first PC has to be made even */
  operations[insn->flags >> 1][insn->flags & 1][insn->shift](core, insn);
  core->r[13] &= ~3u;
  core->r[15] &= ~1u;
}

void choose_alu(Insn *insn, enum Alu alu, enum Operand operand, bool set_flags) {
  insn->run = operations[alu][set_flags][operand];
  if ((insn->d == 13 || insn->d == 15) && alu < TST) {
    insn->flags = (uint8_t)(alu << 1 | set_flags);
    insn->shift = operand;
    insn->run = into_sp_or_pc;
  }
}

void choose_alu16(Insn *insn, enum Alu alu, enum Operand operand) {
  choose_alu(insn, alu, operand, true);
  insn->run_in_it = operations[alu][false][operand];
}
