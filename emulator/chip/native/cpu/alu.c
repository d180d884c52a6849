/* The instructions from AND to CMP with each kind of second operand (ARMv7-M ARM A5.3.1, A5.3.11).
 *
 * Macros generate a function for each combination, so that nothing must be selected at run time. Operands are read
 * before results are written, because register d may be the same as n or m.
 */
#include "cpu/operations.h"

/* -- second operand and carry (Shift_C, A7.4.2) ------------------------------------------------------- */

INLINE uint32_t by_lsl(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  *carry = m >> (32 - insn->shift) & 1;
  return m << insn->shift;
}

INLINE uint32_t by_lsr(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m] >> (insn->shift - 1);
  *carry = m & 1;
  return m >> 1;
}

INLINE uint32_t by_asr(const Core *core, const Insn *insn, uint32_t *carry) {
  int32_t m = (int32_t)core->r[insn->m] >> (insn->shift - 1);
  *carry = m & 1;
  return (uint32_t)(m >> 1);
}

INLINE uint32_t by_ror(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  uint32_t result = m >> insn->shift | m << (32 - insn->shift);
  *carry = result >> 31;
  return result;
}

INLINE uint32_t by_rrx(const Core *core, const Insn *insn, uint32_t *carry) {
  uint32_t m = core->r[insn->m];
  *carry = m & 1;
  return core->c << 31 | m >> 1;
}

INLINE uint32_t unshifted(const Core *core, const Insn *insn, uint32_t *carry) {
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

#define EACH_OPERAND(DEFINE, ...)  \
  DEFINE(by_lsl, __VA_ARGS__)      \
  DEFINE(by_lsr, __VA_ARGS__)      \
  DEFINE(by_asr, __VA_ARGS__)      \
  DEFINE(by_ror, __VA_ARGS__)      \
  DEFINE(by_rrx, __VA_ARGS__)      \
  DEFINE(unshifted, __VA_ARGS__)   \
  DEFINE(constant, __VA_ARGS__)    \
  DEFINE(rotated_constant, __VA_ARGS__)

/* AddWithCarry (A2.2.1). */
INLINE uint32_t add_with_carry(Core *core, uint32_t x, uint32_t y, uint32_t carry_in) {
  uint64_t sum = (uint64_t)x + y + carry_in;
  uint32_t result = (uint32_t)sum;
  core->zc = sum;
  core->n = result;
  core->v = (x ^ result) & (y ^ result);
  return result;
}

#define FETCH(operand)                       \
  uint32_t carry;                            \
  uint32_t m = operand(core, insn, &carry);  \
  uint32_t n = core->r[insn->n];             \
  (void)carry, (void)n

/* Variants for IT blocks. These functions do not set flags, and contain no branches, because the host would predict
 * these branches badly. */
#define DEFINE_PREDICATED(operand, name, result)              \
  OPERATION(name##_predicated_##operand) {                    \
    FETCH(operand);                                           \
    uint32_t mask = core->it_mask ^ -(uint32_t)insn->a;       \
    uint32_t before = core->r[insn->d], written = (result);   \
    core->r[insn->d] = before ^ ((before ^ written) & mask);  \
    NEXT;                                                     \
  }

#define DEFINE_LOGICAL(operand, name, result)  \
  DEFINE_PREDICATED(operand, name, result)     \
  OPERATION(name##_##operand) {                \
    FETCH(operand);                            \
    core->r[insn->d] = (result);               \
    NEXT;                                      \
  }                                            \
  OPERATION(name##s_##operand) {               \
    FETCH(operand);                            \
    uint32_t written = (result);               \
    core->r[insn->d] = written;                \
    core->c = carry;                           \
    set_nz(core, written);                     \
    NEXT;                                      \
  }
EACH_OPERAND(DEFINE_LOGICAL, and, n & m)
EACH_OPERAND(DEFINE_LOGICAL, bic, n & ~m)
EACH_OPERAND(DEFINE_LOGICAL, orr, n | m)
EACH_OPERAND(DEFINE_LOGICAL, orn, n | ~m)
EACH_OPERAND(DEFINE_LOGICAL, eor, n ^ m)
EACH_OPERAND(DEFINE_LOGICAL, mov, m)
EACH_OPERAND(DEFINE_LOGICAL, mvn, ~m)

#define DEFINE_ARITHMETIC(operand, name, x, y, carry_in)    \
  DEFINE_PREDICATED(operand, name, (x) + (y) + (carry_in))  \
  OPERATION(name##_##operand) {                             \
    FETCH(operand);                                         \
    core->r[insn->d] = (x) + (y) + (carry_in);              \
    NEXT;                                                   \
  }                                                         \
  OPERATION(name##s_##operand) {                            \
    FETCH(operand);                                         \
    unsigned d = insn->d;                                   \
    core->r[d] = add_with_carry(core, x, y, carry_in);      \
    NEXT;                                                   \
  }
EACH_OPERAND(DEFINE_ARITHMETIC, add, n, m, 0)
EACH_OPERAND(DEFINE_ARITHMETIC, adc, n, m, core->c)
EACH_OPERAND(DEFINE_ARITHMETIC, sbc, n, ~m, core->c)
EACH_OPERAND(DEFINE_ARITHMETIC, sub, n, ~m, 1)
EACH_OPERAND(DEFINE_ARITHMETIC, rsb, m, ~n, 1)

#define DEFINE_TEST(operand, name, result)  \
  OPERATION(name##_##operand) {             \
    FETCH(operand);                         \
    core->c = carry;                        \
    set_nz(core, result);                   \
    NEXT;                                   \
  }
EACH_OPERAND(DEFINE_TEST, tst, n & m)
EACH_OPERAND(DEFINE_TEST, teq, n ^ m)

#define DEFINE_COMPARISON(operand, name, y, carry_in)  \
  OPERATION(name##_##operand) {                        \
    FETCH(operand);                                    \
    add_with_carry(core, n, y, carry_in);              \
    NEXT;                                              \
  }
EACH_OPERAND(DEFINE_COMPARISON, cmn, m, 0)
EACH_OPERAND(DEFINE_COMPARISON, cmp, ~m, 1)

#define ENTRY(operand, name) name##_##operand,
#define ROW(name) {EACH_OPERAND(ENTRY, name)}
#define ALL(name) {ROW(name), ROW(name##s), ROW(name##_predicated)}

enum Variant { WITHOUT_FLAGS, WITH_FLAGS, IN_IT_BLOCK };

/* Indices: enum Alu, Variant, Operand. */
static const Operation operations[ALUS][3][OPERANDS] = {
    [AND] = ALL(and), [BIC] = ALL(bic), [ORR] = ALL(orr), [ORN] = ALL(orn),
    [EOR] = ALL(eor), [ADD] = ALL(add), [ADC] = ALL(adc), [SBC] = ALL(sbc),
    [SUB] = ALL(sub), [RSB] = ALL(rsb), [MOV] = ALL(mov), [MVN] = ALL(mvn),
    [TST] = {ROW(tst), ROW(tst)}, [TEQ] = {ROW(teq), ROW(teq)},
    [CMN] = {ROW(cmn), ROW(cmn)}, [CMP] = {ROW(cmp), ROW(cmp)},
};

void select_alu(Insn *insn, enum Alu alu, enum Operand operand, bool set_flags) {
  insn->n = alu == MOV || alu == MVN ? 0 : insn->n;
  insn->d = alu >= TST ? 0 : insn->d;
  bool simple = alu < TST && !set_flags && insn->d != 13 && insn->d != 15 && insn->n != 15 && insn->m != 15;
  bool predicated = simple && insn->it;
  insn->run = operations[alu][predicated ? IN_IT_BLOCK : set_flags][operand];
  if (predicated) {
    insn->flags |= PREDICATED;
    insn->a = insn->it < 0xE0 ? insn->it >> 4 & 1 : 0;
  }
  writes_d(insn);
}

void select_alu16(Insn *insn, enum Alu alu, enum Operand operand) {
  select_alu(insn, alu, operand, !insn->it);
}
