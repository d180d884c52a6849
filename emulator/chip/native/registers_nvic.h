/* Nested vectored interrupt controller (ARMv7-M ARM B3.4); offsets in the system control space.
 *
 * Made of emulator/chip/registers/nvic.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_NVIC_H
#define FCU_REGISTERS_NVIC_H

#include <stdint.h>

/* Interrupt controller type. */
enum { ICTR = 0x04 };
#define ICTR_RESET 0x00000002u
#define ICTR_INTLINESNUM 0x0000000Fu
#define ICTR_INTLINESNUM_SHIFT 0

/* Interrupt set-enable. */
#define NVIC_ISERx(x) (0x100u + 0x04u * (x))

/* Interrupt clear-enable. */
#define NVIC_ICERx(x) (0x180u + 0x04u * (x))

/* Interrupt set-pending. */
#define NVIC_ISPRx(x) (0x200u + 0x04u * (x))

/* Interrupt clear-pending. */
#define NVIC_ICPRx(x) (0x280u + 0x04u * (x))

/* Interrupt active bit. */
#define NVIC_IABRx(x) (0x300u + 0x04u * (x))

/* Interrupt priority, four interrupts each. */
#define NVIC_IPRx(x) (0x400u + 0x04u * (x))
#define NVIC_IPRx_PRI_Nx(x) (0x000000FFu << 8 * (x))

/* Software trigger interrupt. */
enum { STIR = 0xF00 };
#define STIR_INTID 0x000001FFu
#define STIR_INTID_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t NVIC_OFFSETS[] = {
  0x04, 0x100, 0x104, 0x108, 0x180, 0x184, 0x188, 0x200,
  0x204, 0x208, 0x280, 0x284, 0x288, 0x300, 0x304, 0x308,
  0x400, 0x404, 0x408, 0x40C, 0x410, 0x414, 0x418, 0x41C,
  0x420, 0x424, 0x428, 0x42C, 0x430, 0x434, 0x438, 0x43C,
  0x440, 0x444, 0x448, 0x44C, 0x450, 0x454, 0xF00,
  -1,
};

#endif
