/* Branches, IT, SVC, BKPT (ARMv7-M ARM A5.2.5, A5.2.6, A5.3.4). imm: the target of a branch. */
#include "branch.h"
#include "system.h"

/* -- branches ------------------------------------------------------------------------------------------- */

static void b(Core *core, const Insn *insn) { execute_at(core, insn->imm); }

/* Every other condition (A7.3.1); the ones between are their opposites. */
typedef bool Condition(const Core *core);

static inline bool is_eq(const Core *core) { return core->z == 0; }
static inline bool is_cs(const Core *core) { return core->c; }
static inline bool is_mi(const Core *core) { return core->n >> 31; }
static inline bool is_vs(const Core *core) { return core->v; }
static inline bool is_hi(const Core *core) { return core->c && core->z != 0; }
static inline bool is_ge(const Core *core) { return core->n >> 31 == core->v; }
static inline bool is_gt(const Core *core) { return core->z != 0 && core->n >> 31 == core->v; }

#define DEFINE_BRANCH(name, condition)                                         \
  static void name(Core *core, const Insn *insn) {                             \
    if (condition) {                                                           \
      execute_at(core, insn->imm);                                             \
    } else {                                                                   \
      execute_next(core, insn);                                                \
    }                                                                          \
  }
DEFINE_BRANCH(beq, is_eq(core))
DEFINE_BRANCH(bne, !is_eq(core))
DEFINE_BRANCH(bcs, is_cs(core))
DEFINE_BRANCH(bcc, !is_cs(core))
DEFINE_BRANCH(bmi, is_mi(core))
DEFINE_BRANCH(bpl, !is_mi(core))
DEFINE_BRANCH(bvs, is_vs(core))
DEFINE_BRANCH(bvc, !is_vs(core))
DEFINE_BRANCH(bhi, is_hi(core))
DEFINE_BRANCH(bls, !is_hi(core))
DEFINE_BRANCH(bge, is_ge(core))
DEFINE_BRANCH(blt, !is_ge(core))
DEFINE_BRANCH(bgt, is_gt(core))
DEFINE_BRANCH(ble, !is_gt(core))

static const Operation branches[14] = {beq, bne, bcs, bcc, bmi, bpl, bvs, bvc, bhi, bls, bge, blt, bgt, ble};

static void bl(Core *core, const Insn *insn) {
  core->r[14] = core->r[15] | 1;
  execute_at(core, insn->imm);
}

static void bx(Core *core, const Insn *insn) { branch_exchange(core, core->r[insn->m]); }

/* PC has bit 0 clear: there is no ARM state to go to. */
static void bx_pc(Core *core, const Insn *insn) { branch_exchange(core, insn->imm); }

/* BLXWritePC (A2.3.1) knows no exception return. */
static void blx(Core *core, const Insn *insn) {
  uint32_t target = core->r[insn->m];
  core->r[14] = core->r[15] | 1;
  branch_interworking(core, target);
}

static void cbz(Core *core, const Insn *insn) {
  if (core->r[insn->n] == 0) {
    execute_at(core, insn->imm);
  } else {
    execute_next(core, insn);
  }
}

static void cbnz(Core *core, const Insn *insn) {
  if (core->r[insn->n] != 0) {
    execute_at(core, insn->imm);
  } else {
    execute_next(core, insn);
  }
}

static bool decode_branch(Operation run, uint32_t target, Insn *insn) {
  insn->run = run;
  insn->imm = target;
  return true;
}

static bool decode_exchange(uint32_t address, uint16_t first, Insn *insn) {
  bool links = bits(first, 7, 7);
  insn->m = bits(first, 6, 3);
  insn->imm = address + 4;
  insn->run = links ? blx : insn->m == 15 ? bx_pc : bx;
  return bits(first, 2, 0) == 0;
}

/* -- others --------------------------------------------------------------------------------------------- */

/* imm: ITSTATE of each instruction of the block, a byte each, the first one's lowest. */

/* The rest of the block where an instruction is yet to be decoded, or somebody asks to see each of them. */
static void it_carefully(Core *core, uint32_t states, uint32_t pc) {
  core->itstate = states & 0xFF;
  core->r[15] = pc;
  core_it_block(core);
}

__attribute__((always_inline)) static inline void it_block(Core *core, const Insn *insn,
                                                           Condition *condition) {
  uint64_t ahead = core->ahead;
  uint32_t states = insn->imm, pc = core->r[15];
  if (UNLIKELY(core->code_hook != NULL)) {
    it_carefully(core, states, pc);
    return;
  }
  core->ahead = 0;
  do {
    insn += insn->size / 2;
    if (UNLIKELY(!insn->run)) {
      it_carefully(core, states, pc);
      return;
    }
    pc += insn->size;
    if (condition(core) != (states >> 4 & 1) || insn->always) { /* bit 4 inverts the condition */
      core->counter++;
      core->r[15] = pc;
      core->itstate = states & 0xFF;
      insn->run_in_it(core, insn);
      if (UNLIKELY(core->r[15] != pc || core->stop != STOP_SLICE)) {
        core_it_left(core, ahead);
        return;
      }
    }
    states >>= 8;
  } while (states);
  core->r[15] = pc;
  core->itstate = 0;
  core->ahead = ahead < core->limit ? ahead : core->limit; /* which may have changed */
  execute_next(core, insn);
}

#define DEFINE_IT(name)                                                        \
  static void it_##name(Core *core, const Insn *insn) { it_block(core, insn, is_##name); }
DEFINE_IT(eq)
DEFINE_IT(cs)
DEFINE_IT(mi)
DEFINE_IT(vs)
DEFINE_IT(hi)
DEFINE_IT(ge)
DEFINE_IT(gt)

/* There is no opposite of always. */
static void it_al(Core *core, const Insn *insn) { it_carefully(core, insn->imm, core->r[15]); }

/* UNPREDICTABLE (A7.7.38). */
static void it_in_it(Core *core, const Insn *insn) { stop_on(core, insn, STOP_UNDEFINED); }

static bool decode_it(uint32_t itstate, Insn *insn) {
  static const Operation operations[8] = {it_eq, it_cs, it_mi, it_vs, it_hi, it_ge, it_gt, it_al};
  insn->run = operations[itstate >> 5];
  insn->run_in_it = it_in_it;
  for (unsigned shift = 0; itstate; shift += 8, itstate = it_advance(itstate)) {
    insn->imm |= itstate << shift;
  }
  return true;
}

static void svc(Core *core, const Insn *insn) {
  (void)insn;
  stop_behind(core, STOP_SVC);
}

static void bkpt(Core *core, const Insn *insn) { stop_on(core, insn, STOP_BKPT); }

/* 1011: what is neither data processing nor PUSH and POP. */
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
    insn->always = true;
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
    return condition == 15; /* 14: UDF */
  case 0xE: return decode_branch(b, address + 4 + 2 * (uint32_t)sign_extend(first, 11), insn);
  default: return false;
  }
}

/* 11110..., 1...: A5.3.4. */
bool decode_control32(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  uint32_t s = bits(first, 10, 10), j1 = bits(second, 13, 13), j2 = bits(second, 11, 11);
  uint32_t low = bits(second, 10, 0), pc = address + 4;
  unsigned condition = bits(first, 9, 6);
  if (bits(second, 12, 12)) { /* B and BL: 25 bits (A7.7.12, encoding T4) */
    uint32_t offset = s << 23 | (j1 ^ s ^ 1) << 22 | (j2 ^ s ^ 1) << 21 | bits(first, 9, 0) << 11 | low;
    return decode_branch(bits(second, 14, 14) ? bl : b, pc + 2 * (uint32_t)sign_extend(offset, 24), insn);
  }
  if (bits(second, 14, 14)) {
    return false; /* BLX to ARM state, UDF */
  }
  if (condition < 14) { /* 21 bits (encoding T3) */
    uint32_t offset = s << 19 | j2 << 18 | j1 << 17 | bits(first, 5, 0) << 11 | low;
    return decode_branch(branches[condition], pc + 2 * (uint32_t)sign_extend(offset, 20), insn);
  }
  return decode_system32(first, second, insn);
}
