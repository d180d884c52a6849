/* DWT (ARMv7-M ARM C1.8). CYCCNT counts while DEMCR.TRCENA and DWT_CTRL.CYCCNTENA are set. It goes on in sleep
 * here, where HCLK runs on; the manual leaves that to the implementation.
 *
 * NOT MODELLED: comparators and profiling counters are stored only.
 */
#include "dwt.h"

#include "chip.h"
#include "registers_dwt.h"

#define BASE 0xE0001000u

typedef __int128 Wide;

static uint32_t counted(const Dwt *dwt) {
  if (!dwt->trace_enabled || !(dwt->registers[0] & DWT_CTRL_CYCCNTENA)) {
    return 0;
  }
  /* Times are rounded down by less than 1 ps, which is given back here. */
  return (uint32_t)((Wide)(dwt->block.chip->now_ps - dwt->since_ps + 1) * dwt->hz / PS_PER_S);
}

/* The count so far becomes the value counted on from. */
static void settle(Dwt *dwt) {
  dwt->registers[DWT_CYCCNT / 4] += counted(dwt);
  dwt->since_ps = dwt->block.chip->now_ps;
  dwt->hz = dwt->block.chip->clocks.hclk_hz;
}

static uint32_t peek(const Block *block, uint32_t offset) {
  const Dwt *dwt = (const Dwt *)block;
  if (offset / 4 >= DWT_STORED) {
    return 0;
  }
  return dwt->registers[offset / 4] + (offset == DWT_CYCCNT ? counted(dwt) : 0);
}

static uint32_t read(Block *block, uint32_t offset, int64_t *until_ps) {
  if (offset == DWT_CYCCNT) {
    *until_ps = ALREADY_PS;
  }
  return peek(block, offset);
}

static void write(Block *block, uint32_t offset, uint32_t value, uint32_t mask) {
  Dwt *dwt = (Dwt *)block;
  settle(dwt);
  if (offset / 4 < DWT_STORED) {
    uint32_t *word = &dwt->registers[offset / 4];
    mask &= offset == DWT_CTRL ? DWT_CTRL_STORED : WORD;
    *word = (*word & ~mask) | (value & mask);
  }
}

void dwt_enable(Dwt *dwt, bool on) {
  settle(dwt);
  dwt->trace_enabled = on;
}

void dwt_reset(Dwt *dwt) {
  dwt->registers[0] = DWT_CTRL_RESET;
  for (int n = 1; n < DWT_STORED; n++) {
    dwt->registers[n] = 0;
  }
  dwt->trace_enabled = 0;
  settle(dwt);
}

static bool is_pure(const Block *block, uint32_t offset) {
  (void)block;
  return offset != DWT_CYCCNT;
}

static void reset(Block *block) { dwt_reset((Dwt *)block); }

static void clocks_changed(Block *block) { settle((Dwt *)block); }

void dwt_create(Chip *chip) {
  static const BlockType type = {.read = read, .peek = peek, .write = write, .reset = reset, .is_pure = is_pure,
                                 .clocks_changed = clocks_changed};
  block_create(chip, &chip->dwt.block, &type, BASE, 0x1000, DWT_OFFSETS);
  dwt_reset(&chip->dwt);
}
