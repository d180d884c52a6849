/* System configuration controller (RM0368 section 7.2).
 *
 * Made of emulator/chip/registers/syscfg.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_SYSCFG_H
#define FCU_REGISTERS_SYSCFG_H

#include <stdint.h>

/* Memory remap. */
enum { MEMRMP = 0x00 };
#define MEMRMP_STORED 0x00000003u
#define MEMRMP_MEM_MODE 0x00000003u
#define MEMRMP_MEM_MODE_SHIFT 0

/* Peripheral mode configuration. */
enum { PMC = 0x04 };
#define PMC_STORED 0x00010000u
#define PMC_ADC1DC2 0x00010000u

/* External interrupt configuration, lines 0 to 3. */
enum { EXTICR1 = 0x08 };
#define EXTICR1_STORED 0x0000FFFFu
#define EXTICR1_EXTIx(x) (0x0000000Fu << 4 * (x))

/* External interrupt configuration, lines 4 to 7. */
enum { EXTICR2 = 0x0C };
#define EXTICR2_STORED 0x0000FFFFu
#define EXTICR2_EXTIx(x) (0x0000000Fu << 4 * ((x) - 4))

/* External interrupt configuration, lines 8 to 11. */
enum { EXTICR3 = 0x10 };
#define EXTICR3_STORED 0x0000FFFFu
#define EXTICR3_EXTIx(x) (0x0000000Fu << 4 * ((x) - 8))

/* External interrupt configuration, lines 12 to 15. */
enum { EXTICR4 = 0x14 };
#define EXTICR4_STORED 0x0000FFFFu
#define EXTICR4_EXTIx(x) (0x0000000Fu << 4 * ((x) - 12))

/* Compensation cell control. */
enum { CMPCR = 0x20 };
#define CMPCR_STORED 0x00000001u
#define CMPCR_READY 0x00000100u
#define CMPCR_CMP_PD 0x00000001u

/* All of them; -1 ends the list. */
static const int16_t SYSCFG_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x20,
  -1,
};

#endif
