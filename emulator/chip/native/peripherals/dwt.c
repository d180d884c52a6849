/* DWT (ARMv7-M ARM C1.8). CYCCNT counts while TRCENA and CYCCNTENA are set, also during sleep, because HCLK keeps
 * running, but not in Stop.
 *
 * NOT MODELLED: comparators and profiling counters, whose registers are stored.
 */
#include "peripherals/dwt.h"

#include "chip.h"
#include "generated/registers_dwt.h"


typedef __int128 Wide;

static uint32_t counted(const Dwt *dwt) {
  if (!dwt->trace_enabled || !(dwt->registers[0] & DWT_CTRL_CYCCNTENA)) {
    return 0;
  }
  /* The 1 ps compensates for rounding down. */
  return (uint32_t)((Wide)(dwt->peripheral.chip->now_ps - dwt->since_ps + 1) * dwt->hz / PS_PER_S);
}

static void rebase(Dwt *dwt) {
  dwt->registers[DWT_CYCCNT / 4] += counted(dwt);
  dwt->since_ps = dwt->peripheral.chip->now_ps;
  dwt->hz = dwt->peripheral.chip->clocks.hclk_hz;
}

static uint32_t peek(const Peripheral *peripheral, uint32_t offset) {
  const Dwt *dwt = (const Dwt *)peripheral;
  if (offset / 4 >= DWT_STORED) {
    return 0;
  }
  return dwt->registers[offset / 4] + (offset == DWT_CYCCNT ? counted(dwt) : 0);
}

static uint32_t read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  if (offset == DWT_CYCCNT) {
    *until_ps = NOT_CACHEABLE_PS;
  }
  return peek(peripheral, offset);
}

static void write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Dwt *dwt = (Dwt *)peripheral;
  rebase(dwt);
  if (offset / 4 < DWT_STORED) {
    write_bits(&dwt->registers[offset / 4], value, mask, offset == DWT_CTRL ? DWT_CTRL_STORED : WORD);
  }
}

void dwt_enable(Dwt *dwt, bool on) {
  rebase(dwt);
  dwt->trace_enabled = on;
}

void dwt_reset(Dwt *dwt) {
  dwt->registers[0] = DWT_CTRL_RESET;
  for (int n = 1; n < DWT_STORED; n++) {
    dwt->registers[n] = 0;
  }
  dwt->trace_enabled = 0;
  rebase(dwt);
}

static bool is_pure(const Peripheral *peripheral, uint32_t offset) {
  (void)peripheral;
  return offset != DWT_CYCCNT;
}

static void reset(Peripheral *peripheral) { dwt_reset((Dwt *)peripheral); }

static void clocks_changed(Peripheral *peripheral) { rebase((Dwt *)peripheral); }

void dwt_create(Chip *chip) {
  static const PeripheralType type = {.read = read, .peek = peek, .write = write, .reset = reset, .is_pure = is_pure,
                                 .clocks_changed = clocks_changed};
  peripheral_create(chip, &chip->dwt.peripheral, &type, DWT_BASE, DWT_SIZE, DWT_OFFSETS);
  dwt_reset(&chip->dwt);
}
