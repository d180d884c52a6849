/* Loads and stores of several registers: LDM, STM, POP, PUSH, LDRD, STRD (ARMv7-M ARM A7.7.40, A7.7.49,
 * A7.7.99, A7.7.101, A7.7.159, A7.7.166). An address that is not a multiple of 4 is taken as it is.
 */
#include <string.h>

#include "branch.h"
#include "transfers.h"

/* -- LDM, STM: imm is the list, by its size in bytes, flags whether PC is loaded, too ------------------- */

#define FIRST_IN(list) __builtin_ctz(list)
#define FOR_EACH_IN(list, rest) for (uint32_t rest = (list); rest; rest &= rest - 1)

/* Where in RAM all of the words are; NULL if some are elsewhere. */
static inline uint8_t *words_in_ram(const Core *core, const Insn *insn, uint32_t address) {
  uint32_t offset = address - RAM_BASE;
  return LIKELY(offset <= RAM_SIZE - insn->by) ? core->ram + offset : NULL;
}

/* What has been read goes to the registers, then to PC. The base may be in the list; then it is loaded. */
static inline void take_words(Core *core, const Insn *insn, const uint8_t *words, uint32_t base) {
  core->r[insn->n] = base;
  FOR_EACH_IN(insn->imm, rest) {
    memcpy(&core->r[FIRST_IN(rest)], words, 4);
    words += 4;
  }
  if (insn->flags) {
    uint32_t target;
    memcpy(&target, words, 4);
    branch_exchange(core, target);
  } else {
    execute_next(core, insn);
  }
}

/* Nothing is changed before all has been read. */
__attribute__((noinline)) static void load_one_by_one(Core *core, const Insn *insn, uint32_t address,
                                                      uint32_t base) {
  uint32_t values[16];
  for (uint32_t n = 0; n < insn->by / 4u; n++) {
    if (!load32(core, insn, address + 4 * n, &values[n])) {
      return;
    }
  }
  take_words(core, insn, (const uint8_t *)values, base);
}

static inline void load_multiple(Core *core, const Insn *insn, uint32_t address, uint32_t base) {
  const uint8_t *words = words_in_ram(core, insn, address);
  if (LIKELY(words && !core->memory_hook)) {
    take_words(core, insn, words, base);
  } else {
    load_one_by_one(core, insn, address, base);
  }
}

__attribute__((noinline)) static void store_one_by_one(Core *core, const Insn *insn, uint32_t address,
                                                       uint32_t base) {
  FOR_EACH_IN(insn->imm, rest) {
    if (!store32(core, insn, address, core->r[FIRST_IN(rest)])) {
      return;
    }
    address += 4;
  }
  core->r[insn->n] = base;
  execute_next(core, insn);
}

static inline void store_multiple(Core *core, const Insn *insn, uint32_t address, uint32_t base) {
  uint8_t *words = words_in_ram(core, insn, address);
  if (UNLIKELY(!words || core->slow_stores)) {
    store_one_by_one(core, insn, address, base);
    return;
  }
  core->stored[(address - RAM_BASE) >> PAGE_BITS] = 1;
  core->stored[(address - RAM_BASE + insn->by - 1) >> PAGE_BITS] = 1;
  FOR_EACH_IN(insn->imm, rest) {
    memcpy(words, &core->r[FIRST_IN(rest)], 4);
    words += 4;
  }
  core->r[insn->n] = base;
  execute_next(core, insn);
}

#define DEFINE_MULTIPLE(name, access, address, base)                           \
  static void name(Core *core, const Insn *insn) {                             \
    uint32_t n = core->r[insn->n];                                             \
    access(core, insn, address, base);                                         \
  }
DEFINE_MULTIPLE(ldmia, load_multiple, n, n)
DEFINE_MULTIPLE(ldmia_write_back, load_multiple, n, n + insn->by)
DEFINE_MULTIPLE(ldmdb, load_multiple, n - insn->by, n)
DEFINE_MULTIPLE(ldmdb_write_back, load_multiple, n - insn->by, n - insn->by)
DEFINE_MULTIPLE(stmia, store_multiple, n, n)
DEFINE_MULTIPLE(stmia_write_back, store_multiple, n, n + insn->by)
DEFINE_MULTIPLE(stmdb, store_multiple, n - insn->by, n)
DEFINE_MULTIPLE(stmdb_write_back, store_multiple, n - insn->by, n - insn->by)

bool decode_multiple(bool load, bool before, bool write_back, unsigned n, uint32_t list, Insn *insn) {
  static const Operation operations[2][2][2] = {
      {{stmia, stmia_write_back}, {stmdb, stmdb_write_back}},
      {{ldmia, ldmia_write_back}, {ldmdb, ldmdb_write_back}},
  };
  insn->run = operations[load][before][write_back];
  insn->n = n;
  insn->by = 4 * __builtin_popcount(list);
  insn->flags = load && list >> 15;
  insn->imm = load ? list & 0x7FFF : list;
  return list != 0 && n != 15;
}

/* -- LDRD, STRD: d and a are the two registers ---------------------------------------------------------- */

static inline bool ldrd(Core *core, const Insn *insn, uint32_t address) {
  uint32_t first, second;
  if (UNLIKELY(!load32(core, insn, address, &first) || !load32(core, insn, address + 4, &second))) {
    return false;
  }
  core->r[insn->d] = first;
  core->r[insn->a] = second;
  return true;
}

static inline bool strd(Core *core, const Insn *insn, uint32_t address) {
  return store32(core, insn, address, core->r[insn->d]) && store32(core, insn, address + 4, core->r[insn->a]);
}

DEFINE_FORMS(strd)
DEFINE_FORMS(ldrd)
DEFINE_LITERAL(ldrd)

bool decode_dual(bool load, enum Form form, unsigned n, uint16_t second, uint32_t imm, Insn *insn) {
  static const Operation operations[2][FORMS] = {
      {[OFFSET] = strd_offset, [PRE_INDEXED] = strd_pre_indexed, [POST_INDEXED] = strd_post_indexed},
      {ldrd_offset, NULL, ldrd_literal, ldrd_pre_indexed, ldrd_post_indexed},
  };
  insn->run = operations[load][form];
  insn->n = n;
  insn->d = bits(second, 15, 12);
  insn->a = bits(second, 11, 8);
  insn->imm = imm;
  bool stack_or_pc = insn->d == 13 || insn->d == 15 || insn->a == 13 || insn->a == 15;
  return !(load && stack_or_pc); /* UNPREDICTABLE */
}
