/* External interrupt and event controller (RM0368 section 10.3).
 *
 * Made of emulator/chip/registers/exti.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_EXTI_H
#define FCU_REGISTERS_EXTI_H

#include <stdint.h>

/* Interrupt mask. */
enum { IMR = 0x00 };
#define IMR_STORED 0x007FFFFFu
#define IMR_MRx(x) (0x00000001u << 1 * (x))

/* Event mask. */
enum { EMR = 0x04 };
#define EMR_STORED 0x007FFFFFu
#define EMR_MRx(x) (0x00000001u << 1 * (x))

/* Rising trigger selection. */
enum { RTSR = 0x08 };
#define RTSR_STORED 0x007FFFFFu
#define RTSR_TRx(x) (0x00000001u << 1 * (x))

/* Falling trigger selection. */
enum { FTSR = 0x0C };
#define FTSR_STORED 0x007FFFFFu
#define FTSR_TRx(x) (0x00000001u << 1 * (x))

/* Software interrupt event. */
enum { SWIER = 0x10 };
#define SWIER_STORED 0x007FFFFFu
#define SWIER_SWIERx(x) (0x00000001u << 1 * (x))

/* Pending. */
enum { PR = 0x14 };
#define PR_PRx(x) (0x00000001u << 1 * (x))

/* All of them; -1 ends the list. */
static const int16_t EXTI_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14,
  -1,
};

#endif
