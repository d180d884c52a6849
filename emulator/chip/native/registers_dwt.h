/* Data watchpoint and trace unit (ARMv7-M ARM C1.8).
 *
 * Made of emulator/chip/registers/dwt.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_DWT_H
#define FCU_REGISTERS_DWT_H

#include <stdint.h>

/* Control. */
enum { DWT_CTRL = 0x00 };
#define DWT_CTRL_RESET 0x40000000u
#define DWT_CTRL_STORED 0x007F1FFFu
#define DWT_CTRL_NUMCOMP 0xF0000000u
#define DWT_CTRL_NUMCOMP_SHIFT 28
#define DWT_CTRL_CYCEVTENA 0x00400000u
#define DWT_CTRL_FOLDEVTENA 0x00200000u
#define DWT_CTRL_LSUEVTENA 0x00100000u
#define DWT_CTRL_SLEEPEVTENA 0x00080000u
#define DWT_CTRL_EXCEVTENA 0x00040000u
#define DWT_CTRL_CPIEVTENA 0x00020000u
#define DWT_CTRL_EXCTRCENA 0x00010000u
#define DWT_CTRL_PCSAMPLENA 0x00001000u
#define DWT_CTRL_SYNCTAP 0x00000C00u
#define DWT_CTRL_SYNCTAP_SHIFT 10
#define DWT_CTRL_CYCTAP 0x00000200u
#define DWT_CTRL_POSTINIT 0x000001E0u
#define DWT_CTRL_POSTINIT_SHIFT 5
#define DWT_CTRL_POSTPRESET 0x0000001Eu
#define DWT_CTRL_POSTPRESET_SHIFT 1
#define DWT_CTRL_CYCCNTENA 0x00000001u

/* Cycle count. */
enum { DWT_CYCCNT = 0x04 };

/* Additional cycles of instructions. */
enum { DWT_CPICNT = 0x08 };

/* Cycles of exception entry and return. */
enum { DWT_EXCCNT = 0x0C };

/* Cycles asleep. */
enum { DWT_SLEEPCNT = 0x10 };

/* Additional cycles of loads and stores. */
enum { DWT_LSUCNT = 0x14 };

/* Folded instructions. */
enum { DWT_FOLDCNT = 0x18 };

/* Program counter sample. */
enum { DWT_PCSR = 0x1C };

/* Comparator: reference value. */
#define DWT_COMPx(x) (0x20u + 0x10u * (x))

/* Comparator: mask. */
#define DWT_MASKx(x) (0x24u + 0x10u * (x))

/* Comparator: function and match. */
#define DWT_FUNCTIONx(x) (0x28u + 0x10u * (x))

/* Lock access. */
enum { DWT_LAR = 0xFB0 };

/* Lock status. */
enum { DWT_LSR = 0xFB4 };

/* All of them; -1 ends the list. */
static const int16_t DWT_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20, 0x24, 0x28, 0x30, 0x34, 0x38, 0x40, 0x44,
  0x48, 0x50, 0x54, 0x58, 0xFB0, 0xFB4,
  -1,
};

#endif
