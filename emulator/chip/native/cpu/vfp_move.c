/* Transfers of floating-point registers (ARMv7-M ARM A6.5 to A6.7).
 *
 * n: base; d: first S register (a D register is two); a: number of S registers. In moves from and to the
 * core, n and m are core registers.
 */
#include "cpu/transfers.h"
#include "cpu/vfp.h"

#define DEFINE_ACCESSES(suffix)                                                                      \
  INLINE bool vldr_single##suffix(Core *core, const Insn *insn, uint32_t address) {                  \
    use_floating_point(core);                                                                        \
    return is_aligned##suffix(core, address) && load32##suffix(core, address, &core->s[insn->d]);    \
  }                                                                                                  \
  INLINE bool vldr_double##suffix(Core *core, const Insn *insn, uint32_t address) {                  \
    uint32_t low, high;                                                                              \
    use_floating_point(core);                                                                        \
    if (UNLIKELY(!is_aligned##suffix(core, address) || !load32##suffix(core, address, &low) ||       \
                 !load32##suffix(core, address + 4, &high))) {                                       \
      return false;                                                                                  \
    }                                                                                                \
    core->s[insn->d] = low;                                                                          \
    core->s[insn->d + 1] = high;                                                                     \
    return true;                                                                                     \
  }                                                                                                  \
  INLINE bool vstr_single##suffix(Core *core, const Insn *insn, uint32_t address) {                  \
    use_floating_point(core);                                                                        \
    return is_aligned##suffix(core, address) && store32##suffix(core, address, core->s[insn->d]);    \
  }                                                                                                  \
  INLINE bool vstr_double##suffix(Core *core, const Insn *insn, uint32_t address) {                  \
    use_floating_point(core);                                                                        \
    return is_aligned##suffix(core, address) && store32##suffix(core, address, core->s[insn->d]) &&  \
           store32##suffix(core, address + 4, core->s[insn->d + 1]);                                 \
  }
DEFINE_ACCESSES()
DEFINE_ACCESSES(_slow)

#define DEFINE_OFFSET(access) DEFINE_ACCESS(access##_offset, access, core->r[insn->n] + insn->imm, )
DEFINE_OFFSET(vldr_single)
DEFINE_OFFSET(vldr_double)
DEFINE_OFFSET(vstr_single)
DEFINE_OFFSET(vstr_double)
DEFINE_LITERAL(vldr_single)
DEFINE_LITERAL(vldr_double)

static bool decode_one(uint32_t address, uint16_t first, Insn *insn) {
  bool load = first & 0x10, two = insn->a == 2;
  insn->imm = first & 0x80 ? insn->imm : -insn->imm;
  if (insn->n == 15) { /* a store is UNPREDICTABLE */
    insn->imm += (address + 4) & ~3u;
    insn->n = 0;
    insn->run = two ? vldr_double_literal : vldr_single_literal;
    return load;
  }
  if (load) {
    insn->run = two ? vldr_double_offset : vldr_single_offset;
  } else {
    insn->run = two ? vstr_double_offset : vstr_single_offset;
  }
  return true;
}

/* imm: number of bytes that write-back adds; FLDMX and FSTMX count one word more than they transfer. */
#define DEFINE_MULTIPLE_ACCESSES(suffix)                                              \
  INLINE bool vldm##suffix(Core *core, const Insn *insn, uint32_t address) {          \
    uint32_t words[32];                                                               \
    use_floating_point(core);                                                         \
    if (UNLIKELY(!is_aligned##suffix(core, address))) {                               \
      return false;                                                                   \
    }                                                                                 \
    for (unsigned n = 0; n < insn->a; n++) {                                          \
      if (UNLIKELY(!load32##suffix(core, address + 4 * n, &words[n]))) {              \
        return false;                                                                 \
      }                                                                               \
    }                                                                                 \
    memcpy(core->s + insn->d, words, 4u * insn->a);                                   \
    return true;                                                                      \
  }                                                                                   \
  INLINE bool vstm##suffix(Core *core, const Insn *insn, uint32_t address) {          \
    use_floating_point(core);                                                         \
    if (UNLIKELY(!is_aligned##suffix(core, address))) {                               \
      return false;                                                                   \
    }                                                                                 \
    for (unsigned n = 0; n < insn->a; n++) {                                          \
      if (UNLIKELY(!store32##suffix(core, address + 4 * n, core->s[insn->d + n]))) {  \
        return false;                                                                 \
      }                                                                               \
    }                                                                                 \
    return true;                                                                      \
  }
DEFINE_MULTIPLE_ACCESSES()
DEFINE_MULTIPLE_ACCESSES(_slow)

#define DEFINE_MULTIPLE(letters)                                                                           \
  DEFINE_ACCESS(letters##ia, letters, core->r[insn->n], )                                                  \
  DEFINE_ACCESS(letters##ia_back, letters, core->r[insn->n], write_base(core, insn, address + insn->imm))  \
  DEFINE_ACCESS(letters##db_back, letters, core->r[insn->n] - insn->imm, write_base(core, insn, address))
DEFINE_MULTIPLE(vldm)
DEFINE_MULTIPLE(vstm)

static bool decode_vfp_multiple(uint16_t first, Insn *insn) {
  bool load = first & 0x10, back = first & 0x20, before = first & 0x100;
  insn->a = (uint8_t)(insn->imm / 4); /* number of words; the caller makes it even for D registers */
  if (before) {
    insn->run = load ? vldmdb_back : vstmdb_back;
  } else {
    insn->run = back ? (load ? vldmia_back : vstmia_back) : load ? vldmia : vstmia;
  }
  return insn->n != 15;
}

static bool decode_registers(uint16_t second, unsigned d_bit, Insn *insn) {
  bool is_double = second & 0x100;
  insn->d = is_double ? (uint8_t)(2 * (second >> 12)) : single(second >> 12, d_bit);
  return !(is_double && d_bit);
}

static bool decode_two_cores(uint16_t first, uint16_t second, Insn *insn);

/* Section A6.5, and 64-bit transfers of A6.7. */
bool decode_vfp_memory(uint32_t address, uint16_t first, uint16_t second, Insn *insn) {
  bool before = first & 0x100, up = first & 0x80, back = first & 0x20, is_double = second & 0x100;
  insn->n = first & 15;
  insn->imm = 4u * (second & 0xFF);
  if (!before && !up) {
    return (first & 0xFE0) == 0xC40 && decode_two_cores(first, second, insn);
  }
  if (!decode_registers(second, first >> 6 & 1, insn)) {
    return false;
  }
  if (before && !back) {
    insn->a = is_double ? 2 : 1;
    return decode_one(address, first, insn);
  }
  if ((before && up) || !decode_vfp_multiple(first, insn)) {
    return false;
  }
  insn->a &= is_double ? ~1 : ~0;
  return insn->a != 0 && insn->a + insn->d <= 32;
}

/* -- moves from and to the core (A6.6, A6.7) ------------------------------------------------------------ */

OPERATION(vmov_to_single) {
  use_floating_point(core);
  core->s[insn->d] = core->r[insn->n];
  NEXT;
}
OPERATION(vmov_to_core) {
  use_floating_point(core);
  core->r[insn->n] = core->s[insn->d];
  NEXT;
}
OPERATION(vmov_to_two) {
  use_floating_point(core);
  core->s[insn->d] = core->r[insn->n];
  core->s[insn->d + 1] = core->r[insn->m];
  NEXT;
}
OPERATION(vmov_to_two_cores) {
  use_floating_point(core);
  core->r[insn->n] = core->s[insn->d];
  core->r[insn->m] = core->s[insn->d + 1];
  NEXT;
}

#define WRITABLE 0xF7C0009Fu

OPERATION(vmsr) {
  use_floating_point(core);
  core->fpscr = core->r[insn->n] & WRITABLE;
  NEXT;
}
OPERATION(vmrs) {
  use_floating_point(core);
  core->r[insn->n] = core->fpscr;
  NEXT;
}
OPERATION(vmrs_apsr) {
  use_floating_point(core);
  core->n = core->fpscr;
  core->z = ~core->fpscr >> 30 & 1;
  core->c = core->fpscr >> 29 & 1;
  core->v = core->fpscr << 3;
  NEXT;
}

/* SP and PC are UNPREDICTABLE. In this model an instruction with SP or PC as result is undefined, except
 * VMRS to PC. */
static bool can_be_moved(bool to_core, unsigned number) { return !to_core || (number != 13 && number != 15); }
static void may_read_pc(Insn *insn) { insn->flags |= insn->n == 15 || insn->m == 15 ? READS_PC : 0; }

static bool decode_two_cores(uint16_t first, uint16_t second, Insn *insn) {
  bool to_core = first & 0x10, is_double = second & 0x100;
  insn->n = second >> 12;
  insn->m = first & 15;
  insn->d = is_double ? (uint8_t)(2 * (second & 15)) : single(second, second >> 5);
  insn->run = to_core ? vmov_to_two_cores : vmov_to_two;
  may_read_pc(insn);
  bool known = (second & 0xD0) == 0x10 && !(is_double && second & 0x20);
  return known && insn->d < 31 && can_be_moved(to_core, insn->n) && can_be_moved(to_core, insn->m);
}

bool decode_vfp_move(uint16_t first, uint16_t second, Insn *insn) {
  bool to_core = first & 0x10, of_double = second & 0x100;
  insn->n = second >> 12;
  if ((first & 0xFEF) == 0xEE1 && !of_double) {
    insn->run = !to_core ? vmsr : insn->n == 15 ? vmrs_apsr : vmrs;
    return (second & 0xEF) == 0 && (to_core ? insn->n != 13 : insn->n != 15);
  }
  insn->run = to_core ? vmov_to_core : vmov_to_single;
  may_read_pc(insn);
  if (of_double) { /* half of a D register */
    insn->d = (uint8_t)(2 * (first & 15) + (first >> 5 & 1));
    return (first & 0xC0) == 0 && (second & 0xEF) == 0 && can_be_moved(to_core, insn->n);
  }
  insn->d = single(first, second >> 7);
  return (first & 0xE0) == 0 && (second & 0x6F) == 0 && can_be_moved(to_core, insn->n);
}
