/* The system control space, 0xE000E000 (ARMv7-M ARM B3.2): SCB, NVIC and SysTick behind one block. */
#ifndef FCU_SCB_H
#define FCU_SCB_H

#include "block.h"

/* Offsets in the system control space. */
enum {
  SCB_ACTLR = 0x008,
  SCB_CPUID = 0xD00,
  SCB_ICSR = 0xD04,
  SCB_VTOR = 0xD08,
  SCB_AIRCR = 0xD0C,
  SCB_SCR = 0xD10,
  SCB_CCR = 0xD14,
  SCB_SHPR1 = 0xD18,
  SCB_SHPR2 = 0xD1C,
  SCB_SHPR3 = 0xD20,
  SCB_SHCSR = 0xD24,
  SCB_CFSR = 0xD28,
  SCB_HFSR = 0xD2C,
  SCB_DFSR = 0xD30,
  SCB_MMFAR = 0xD34,
  SCB_BFAR = 0xD38,
  SCB_AFSR = 0xD3C,
  SCB_CPACR = 0xD88,
  SCB_DHCSR = 0xDF0,
  SCB_DCRSR = 0xDF4,
  SCB_DCRDR = 0xDF8,
  SCB_DEMCR = 0xDFC,
  SCB_FPCCR = 0xF34,
  SCB_FPCAR = 0xF38,
  SCB_FPDSCR = 0xF3C,
  SCB_MVFR0 = 0xF40,
  SCB_MVFR1 = 0xF44,
};

#define SCR_SLEEPONEXIT (1u << 1)
#define SCR_SEVONPEND (1u << 4)
#define CCR_NONBASETHRDENA (1u << 0)
#define CCR_UNALIGN_TRP (1u << 3)
#define CCR_DIV_0_TRP (1u << 4)
#define CCR_STKALIGN (1u << 9)
#define HFSR_VECTTBL (1u << 1)
#define HFSR_FORCED (1u << 30)
#define HFSR_DEBUGEVT (1u << 31)

typedef struct {
  Block block;
  uint32_t actlr, vtor, aircr, scr, ccr, shpr[3], shcsr, cfsr, hfsr, dfsr, mmfar, bfar, cpacr, demcr;
  uint32_t fpccr, fpcar, fpdscr;
} Scb;

void scb_create(Chip *chip);
void scb_reset(Scb *scb);
/* Whether a configurable fault has its own handler; else it becomes a HardFault (B1.5.14). */
bool scb_fault_enabled(const Scb *scb, int exception);

#endif
