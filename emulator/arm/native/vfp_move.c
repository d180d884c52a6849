/* Floating-point registers from and to memory and the core (ARMv7-M ARM A6.5 to A6.7).
 *
 * Fields: n is the base register; d is the first S register, a double register being two of them; a is how
 * many; imm is an offset. Of moves, n and m are core registers.
 */
#include "vfp.h"

#define OPERATION(name) static void name(Core *core, const Insn *insn)

/* -- VLDR, VSTR ----------------------------------------------------------------------------------------- */

static inline void load_one(Core *core, const Insn *insn, uint32_t address) {
  use_floating_point(core);
  load32(core, insn, address, &core->s[insn->d]);
}
static inline void load_two(Core *core, const Insn *insn, uint32_t address) {
  use_floating_point(core);
  uint32_t low, high;
  if (load32(core, insn, address, &low) && load32(core, insn, address + 4, &high)) {
    core->s[insn->d] = low;
    core->s[insn->d + 1] = high;
  }
}

OPERATION(vldr_single) { load_one(core, insn, core->r[insn->n] + insn->imm); }
OPERATION(vldr_double) { load_two(core, insn, core->r[insn->n] + insn->imm); }
OPERATION(vldr_single_literal) { load_one(core, insn, insn->imm); }
OPERATION(vldr_double_literal) { load_two(core, insn, insn->imm); }

OPERATION(vstr_single) {
  use_floating_point(core);
  store32(core, insn, core->r[insn->n] + insn->imm, core->s[insn->d]);
}
OPERATION(vstr_double) {
  use_floating_point(core);
  uint32_t address = core->r[insn->n] + insn->imm;
  if (store32(core, insn, address, core->s[insn->d])) {
    store32(core, insn, address + 4, core->s[insn->d + 1]);
  }
}

static bool decode_one(uint32_t address, uint16_t first, Insn *insn) {
  bool load = first & 0x10, two = insn->a == 2;
  insn->imm = first & 0x80 ? insn->imm : -insn->imm;
  if (insn->n == 15) { /* a store would be UNPREDICTABLE */
    insn->imm += (address + 4) & ~3u;
    insn->run = two ? vldr_double_literal : vldr_single_literal;
    return load;
  }
  insn->run = load ? (two ? vldr_double : vldr_single) : two ? vstr_double : vstr_single;
  return true;
}

/* -- VLDM, VSTM, VPOP, VPUSH ---------------------------------------------------------------------------- */

/* imm is what the base changes by if it is written back; it can be one word more than is moved (FLDMX). */
static inline void load_multiple(Core *core, const Insn *insn, uint32_t address, uint32_t base_after) {
  use_floating_point(core);
  uint32_t words[32];
  for (unsigned n = 0; n < insn->a; n++) {
    if (UNLIKELY(!load32(core, insn, address + 4 * n, &words[n]))) {
      return;
    }
  }
  memcpy(core->s + insn->d, words, 4u * insn->a);
  core->r[insn->n] = base_after;
}
static inline void store_multiple(Core *core, const Insn *insn, uint32_t address, uint32_t base_after) {
  use_floating_point(core);
  for (unsigned n = 0; n < insn->a; n++) {
    if (UNLIKELY(!store32(core, insn, address + 4 * n, core->s[insn->d + n]))) {
      return;
    }
  }
  core->r[insn->n] = base_after;
}

static uint32_t written(const Insn *insn, uint32_t base) { return insn->n == 13 ? base & ~3u : base; }

#define DEFINE_MULTIPLE(letters, multiple)                                                \
  OPERATION(letters##ia) { multiple(core, insn, core->r[insn->n], core->r[insn->n]); }    \
  OPERATION(letters##ia_back) {                                                           \
    uint32_t address = core->r[insn->n];                                                  \
    multiple(core, insn, address, written(insn, address + insn->imm));                    \
  }                                                                                       \
  OPERATION(letters##db_back) {                                                           \
    uint32_t address = core->r[insn->n] - insn->imm;                                      \
    multiple(core, insn, address, written(insn, address));                                \
  }
DEFINE_MULTIPLE(vldm, load_multiple)
DEFINE_MULTIPLE(vstm, store_multiple)

static bool decode_multiple(uint16_t first, Insn *insn) {
  bool load = first & 0x10, back = first & 0x20, before = first & 0x100;
  insn->a = (uint8_t)(insn->imm / 4); /* before it is made even, for D registers */
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
  return !(is_double && d_bit); /* there are 16 D registers */
}

static bool decode_two_cores(uint16_t first, uint16_t second, Insn *insn);

/* A6.5, and the 64-bit transfers of A6.7, which look alike. */
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
  if ((before && up) || !decode_multiple(first, insn)) {
    return false;
  }
  insn->a &= is_double ? ~1 : ~0;
  return insn->a != 0 && insn->a + insn->d <= 32;
}

/* -- moves from and to the core (A6.6, A6.7) ------------------------------------------------------------ */

OPERATION(vmov_to_single) {
  use_floating_point(core);
  core->s[insn->d] = core->r[insn->n];
}
OPERATION(vmov_to_core) {
  use_floating_point(core);
  core->r[insn->n] = core->s[insn->d];
}
OPERATION(vmov_to_two) {
  use_floating_point(core);
  core->s[insn->d] = core->r[insn->n];
  core->s[insn->d + 1] = core->r[insn->m];
}
OPERATION(vmov_to_two_cores) {
  use_floating_point(core);
  core->r[insn->n] = core->s[insn->d];
  core->r[insn->m] = core->s[insn->d + 1];
}

#define WRITABLE 0xF7C0009Fu /* of FPSCR */

OPERATION(vmsr) {
  use_floating_point(core);
  core->fpscr = core->r[insn->n] & WRITABLE;
}
OPERATION(vmrs) {
  use_floating_point(core);
  core->r[insn->n] = core->fpscr;
}
static void vmrs_apsr(Core *core, const Insn *insn) {
  (void)insn;
  use_floating_point(core);
  core->n = core->fpscr;
  core->z = ~core->fpscr >> 30 & 1;
  core->c = core->fpscr >> 29 & 1;
  core->v = core->fpscr >> 28 & 1;
}

/* SP and PC are UNPREDICTABLE in all of these. As results they are undefined here; PC is not, of VMRS. */
static bool can_be_moved(bool to_core, unsigned number) { return !to_core || (number != 13 && number != 15); }

static bool decode_two_cores(uint16_t first, uint16_t second, Insn *insn) {
  bool to_core = first & 0x10, is_double = second & 0x100;
  insn->n = second >> 12;
  insn->m = first & 15;
  insn->d = is_double ? (uint8_t)(2 * (second & 15)) : single(second, second >> 5);
  insn->run = to_core ? vmov_to_two_cores : vmov_to_two;
  bool known = (second & 0xD0) == 0x10 && !(is_double && second & 0x20);
  return known && insn->d < 31 && can_be_moved(to_core, insn->n) && can_be_moved(to_core, insn->m);
}

bool decode_vfp_move(uint16_t first, uint16_t second, Insn *insn) {
  bool to_core = first & 0x10, of_double = second & 0x100;
  insn->n = second >> 12;
  if ((first & 0xFEF) == 0xEE1 && !of_double) { /* FPSCR, the only system register that firmware sees */
    insn->run = !to_core ? vmsr : insn->n == 15 ? vmrs_apsr : vmrs;
    return (second & 0xEF) == 0 && (to_core ? insn->n != 13 : insn->n != 15);
  }
  insn->run = to_core ? vmov_to_core : vmov_to_single;
  if (of_double) { /* half of a D register, as bit 5 of first says */
    insn->d = (uint8_t)(2 * (first & 15) + (first >> 5 & 1));
    return (first & 0xC0) == 0 && (second & 0xEF) == 0 && can_be_moved(to_core, insn->n);
  }
  insn->d = single(first, second >> 7);
  return (first & 0xE0) == 0 && (second & 0x6F) == 0 && can_be_moved(to_core, insn->n);
}
