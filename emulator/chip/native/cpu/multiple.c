/* LDM, STM, POP, PUSH, LDRD, STRD (ARMv7-M ARM A7.7.40, A7.7.49, A7.7.99, A7.7.101, A7.7.159, A7.7.166). */
#include <string.h>

#include "cpu/transfers.h"

/* -- LDM, STM ------------------------------------------------------------------------------------------
 * imm is the register list; in a load it does not include PC. shift is the size in bytes of all words,
 * including PC. */

#define LOWEST_IN(list) __builtin_ctz(list)
#define FOR_EACH_IN(list, rest) for (uint32_t rest = (list); rest; rest &= rest - 1)

/* Return NULL if the words are not in RAM or accesses must be checked. */
INLINE uint8_t *words_in_ram(const Core *core, const Insn *insn, uint32_t address, uint32_t plain) {
  uint32_t offset = address - RAM_BASE;
  return LIKELY(offset < plain && offset <= RAM_SIZE - insn->shift && !(offset & 3)) ? core->ram + offset : NULL;
}

/* A base register in the list gets the loaded value. */
INLINE void load_registers(Core *core, const Insn *insn, const uint8_t *words, uint32_t base) {
  core->r[insn->n] = base;
  FOR_EACH_IN(insn->imm, rest) {
    memcpy(&core->r[LOWEST_IN(rest)], words, 4);
    words += 4;
  }
}

/* All words are read before a register changes. */
static bool read_words(Core *core, const Insn *insn, uint32_t address, uint8_t *words) {
  if (!core_is_aligned(core, address)) {
    return false;
  }
  for (uint32_t at = 0; at < insn->shift; at += 4) {
    uint32_t value;
    if (!core_read(core, address + at, 4, &value)) {
      return false;
    }
    memcpy(words + at, &value, 4);
  }
  return true;
}

INLINE uint32_t last_word(const Insn *insn, const uint8_t *words) {
  uint32_t word;
  memcpy(&word, words + insn->shift - 4, 4);
  return word;
}

#define DEFINE_LOADS(name, first, base)                                            \
  SLOW_OPERATION(name##_slow) {                                                    \
    uint32_t n = core->r[insn->n];                                                 \
    uint8_t words[64];                                                             \
    sync_state(core, insn, budget);                                                \
    if (read_words(core, insn, first, words)) {                                    \
      load_registers(core, insn, words, base);                                     \
      resume_chain(core, insn);                                                    \
    }                                                                              \
  }                                                                                \
  SLOW_OPERATION(name##_pc_slow) {                                                 \
    uint32_t n = core->r[insn->n];                                                 \
    uint8_t words[64];                                                             \
    sync_state(core, insn, budget);                                                \
    if (read_words(core, insn, first, words)) {                                    \
      load_registers(core, insn, words, base);                                     \
      resume_chain_at(core, bx_write_pc(core, last_word(insn, words)));            \
    }                                                                              \
  }                                                                                \
  OPERATION(name) {                                                                \
    uint32_t n = core->r[insn->n];                                                 \
    const uint8_t *words = words_in_ram(core, insn, first, core->ram_load_limit);  \
    if (UNLIKELY(!words)) {                                                        \
      TAIL name##_slow(core, insn, budget);                                        \
    }                                                                              \
    load_registers(core, insn, words, base);                                       \
    NEXT;                                                                          \
  }                                                                                \
  OPERATION(name##_pc) {                                                           \
    uint32_t n = core->r[insn->n];                                                 \
    const uint8_t *words = words_in_ram(core, insn, first, core->ram_load_limit);  \
    if (UNLIKELY(!words)) {                                                        \
      TAIL name##_pc_slow(core, insn, budget);                                     \
    }                                                                              \
    load_registers(core, insn, words, base);                                       \
    const Insn *next = bx_write_pc(core, last_word(insn, words));                  \
    TAIL enter_block(core, next, budget);                                          \
  }
DEFINE_LOADS(ldmia, n, n)
DEFINE_LOADS(ldmia_write_back, n, n + insn->shift)
DEFINE_LOADS(ldmdb, n - insn->shift, n)
DEFINE_LOADS(ldmdb_write_back, n - insn->shift, n - insn->shift)

#define DEFINE_STORES(name, first, base)                                      \
  SLOW_OPERATION(name##_slow) {                                               \
    uint32_t n = core->r[insn->n], address = first;                           \
    sync_state(core, insn, budget);                                           \
    if (!core_is_aligned(core, address)) {                                    \
      return;                                                                 \
    }                                                                         \
    FOR_EACH_IN(insn->imm, rest) {                                            \
      if (!core_write(core, address, 4, core->r[LOWEST_IN(rest)])) {          \
        return;                                                               \
      }                                                                       \
      address += 4;                                                           \
    }                                                                         \
    core->r[insn->n] = base;                                                  \
    resume_chain(core, insn);                                                 \
  }                                                                           \
  OPERATION(name) {                                                           \
    uint32_t n = core->r[insn->n];                                            \
    uint8_t *words = words_in_ram(core, insn, first, core->ram_store_limit);  \
    if (UNLIKELY(!words)) {                                                   \
      TAIL name##_slow(core, insn, budget);                                   \
    }                                                                         \
    FOR_EACH_IN(insn->imm, rest) {                                            \
      memcpy(words, &core->r[LOWEST_IN(rest)], 4);                            \
      words += 4;                                                             \
    }                                                                         \
    core->r[insn->n] = base;                                                  \
    NEXT;                                                                     \
  }
DEFINE_STORES(stmia, n, n)
DEFINE_STORES(stmia_write_back, n, n + insn->shift)
DEFINE_STORES(stmdb, n - insn->shift, n)
DEFINE_STORES(stmdb_write_back, n - insn->shift, n - insn->shift)

bool decode_multiple(bool load, bool before, bool write_back, unsigned n, uint32_t list, Insn *insn) {
  static const Operation stores[2][2] = {{stmia, stmia_write_back}, {stmdb, stmdb_write_back}};
  static const Operation loads[2][2][2] = {
      {{ldmia, ldmia_write_back}, {ldmdb, ldmdb_write_back}},
      {{ldmia_pc, ldmia_write_back_pc}, {ldmdb_pc, ldmdb_write_back_pc}},
  };
  bool with_pc = list >> 15;
  insn->run = load ? loads[with_pc][before][write_back] : stores[before][write_back];
  insn->n = (uint8_t)n;
  insn->shift = (uint8_t)(4 * __builtin_popcount(list));
  insn->imm = load ? list & 0x7FFF : list;
  if (with_pc) {
    insn->flags |= load ? ENDS_BLOCK : READS_PC;
  }
  return list != 0 && n != 15;
}

/* -- LDRD, STRD: registers d and a -------------------------------------------------------------------- */

#define DEFINE_DUAL(suffix)                                                                          \
  INLINE bool ldrd##suffix(Core *core, const Insn *insn, uint32_t address) {                         \
    uint32_t first, second;                                                                          \
    if (UNLIKELY(!is_aligned##suffix(core, address) || !load32##suffix(core, address, &first) ||     \
                 !load32##suffix(core, address + 4, &second))) {                                     \
      return false;                                                                                  \
    }                                                                                                \
    core->r[insn->d] = first;                                                                        \
    core->r[insn->a] = second;                                                                       \
    return true;                                                                                     \
  }                                                                                                  \
  INLINE bool strd##suffix(Core *core, const Insn *insn, uint32_t address) {                         \
    return is_aligned##suffix(core, address) && store32##suffix(core, address, core->r[insn->d]) &&  \
           store32##suffix(core, address + 4, core->r[insn->a]);                                     \
  }
DEFINE_DUAL()
DEFINE_DUAL(_slow)

DEFINE_FORMS(strd)
DEFINE_FORMS(ldrd)
DEFINE_LITERAL(ldrd)

bool decode_dual(bool load, enum Form form, unsigned n, uint16_t second, uint32_t imm, Insn *insn) {
  static const Operation operations[2][FORMS] = {
      {[OFFSET] = strd_offset, [PRE_INDEXED] = strd_pre_indexed, [POST_INDEXED] = strd_post_indexed},
      {ldrd_offset, NULL, ldrd_literal, ldrd_pre_indexed, ldrd_post_indexed},
  };
  insn->run = operations[load][form];
  insn->n = form == LITERAL_FORM ? 0 : (uint8_t)n;
  insn->d = (uint8_t)bits(second, 15, 12);
  insn->a = (uint8_t)bits(second, 11, 8);
  insn->imm = imm;
  bool stack_or_pc = insn->d == 13 || insn->d == 15 || insn->a == 13 || insn->a == 15;
  return !(load && stack_or_pc);
}
