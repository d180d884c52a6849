/* System control block (ARMv7-M ARM B3.2, PM0214 4.4); offsets in the system control space.
 *
 * Made of emulator/chip/registers/scb.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_SCB_H
#define FCU_REGISTERS_SCB_H

#include <stdint.h>

/* Auxiliary control. */
enum { ACTLR = 0x08 };
#define ACTLR_STORED 0x00000307u
#define ACTLR_DISOOFP 0x00000200u
#define ACTLR_DISFPCA 0x00000100u
#define ACTLR_DISFOLD 0x00000004u
#define ACTLR_DISDEFWBUF 0x00000002u
#define ACTLR_DISMCYCINT 0x00000001u

/* Processor identity. */
enum { CPUID = 0xD00 };
#define CPUID_RESET 0x410FC241u
#define CPUID_IMPLEMENTER 0xFF000000u
#define CPUID_IMPLEMENTER_SHIFT 24
#define CPUID_VARIANT 0x00F00000u
#define CPUID_VARIANT_SHIFT 20
#define CPUID_ARCHITECTURE 0x000F0000u
#define CPUID_ARCHITECTURE_SHIFT 16
#define CPUID_PARTNO 0x0000FFF0u
#define CPUID_PARTNO_SHIFT 4
#define CPUID_REVISION 0x0000000Fu
#define CPUID_REVISION_SHIFT 0

/* Interrupt control and state. */
enum { ICSR = 0xD04 };
#define ICSR_RESET 0x00000800u
#define ICSR_STORED 0x94000000u
#define ICSR_NMIPENDSET 0x80000000u
#define ICSR_PENDSVSET 0x10000000u
#define ICSR_PENDSVCLR 0x08000000u
#define ICSR_PENDSTSET 0x04000000u
#define ICSR_PENDSTCLR 0x02000000u
#define ICSR_ISRPREEMPT 0x00800000u
#define ICSR_ISRPENDING 0x00400000u
#define ICSR_VECTPENDING 0x001FF000u
#define ICSR_VECTPENDING_SHIFT 12
#define ICSR_RETTOBASE 0x00000800u
#define ICSR_VECTACTIVE 0x000001FFu
#define ICSR_VECTACTIVE_SHIFT 0

/* Vector table offset. */
enum { VTOR = 0xD08 };
#define VTOR_STORED 0x3FFFFF80u
#define VTOR_TBLOFF 0x3FFFFF80u
#define VTOR_TBLOFF_SHIFT 7

/* Application interrupt and reset control. */
enum { AIRCR = 0xD0C };
#define AIRCR_RESET 0xFA050000u
#define AIRCR_STORED 0xFFFF0700u
#define AIRCR_VECTKEY 0xFFFF0000u
#define AIRCR_VECTKEY_SHIFT 16
#define AIRCR_ENDIANNESS 0x00008000u
#define AIRCR_PRIGROUP 0x00000700u
#define AIRCR_PRIGROUP_SHIFT 8
#define AIRCR_SYSRESETREQ 0x00000004u
#define AIRCR_VECTCLRACTIVE 0x00000002u
#define AIRCR_VECTRESET 0x00000001u

/* System control. */
enum { SCR = 0xD10 };
#define SCR_STORED 0x00000016u
#define SCR_SEVONPEND 0x00000010u
#define SCR_SLEEPDEEP 0x00000004u
#define SCR_SLEEPONEXIT 0x00000002u

/* Configuration and control. */
enum { CCR = 0xD14 };
#define CCR_RESET 0x00000200u
#define CCR_STORED 0x0000031Bu
#define CCR_STKALIGN 0x00000200u
#define CCR_BFHFNMIGN 0x00000100u
#define CCR_DIV_0_TRP 0x00000010u
#define CCR_UNALIGN_TRP 0x00000008u
#define CCR_USERSETMPEND 0x00000002u
#define CCR_NONBASETHRDENA 0x00000001u

/* System handler priority, 4 to 6. */
enum { SHPR1 = 0xD18 };
#define SHPR1_STORED 0x00FFFFFFu
#define SHPR1_PRI_6 0x00FF0000u
#define SHPR1_PRI_6_SHIFT 16
#define SHPR1_PRI_5 0x0000FF00u
#define SHPR1_PRI_5_SHIFT 8
#define SHPR1_PRI_4 0x000000FFu
#define SHPR1_PRI_4_SHIFT 0

/* System handler priority, 11. */
enum { SHPR2 = 0xD1C };
#define SHPR2_STORED 0xFF000000u
#define SHPR2_PRI_11 0xFF000000u
#define SHPR2_PRI_11_SHIFT 24

/* System handler priority, 12 to 15. */
enum { SHPR3 = 0xD20 };
#define SHPR3_STORED 0xFFFF00FFu
#define SHPR3_PRI_15 0xFF000000u
#define SHPR3_PRI_15_SHIFT 24
#define SHPR3_PRI_14 0x00FF0000u
#define SHPR3_PRI_14_SHIFT 16
#define SHPR3_PRI_12 0x000000FFu
#define SHPR3_PRI_12_SHIFT 0

/* System handler control and state. */
enum { SHCSR = 0xD24 };
#define SHCSR_STORED 0x0007FD8Bu
#define SHCSR_USGFAULTENA 0x00040000u
#define SHCSR_BUSFAULTENA 0x00020000u
#define SHCSR_MEMFAULTENA 0x00010000u
#define SHCSR_SVCALLPENDED 0x00008000u
#define SHCSR_BUSFAULTPENDED 0x00004000u
#define SHCSR_MEMFAULTPENDED 0x00002000u
#define SHCSR_USGFAULTPENDED 0x00001000u
#define SHCSR_SYSTICKACT 0x00000800u
#define SHCSR_PENDSVACT 0x00000400u
#define SHCSR_MONITORACT 0x00000100u
#define SHCSR_SVCALLACT 0x00000080u
#define SHCSR_USGFAULTACT 0x00000008u
#define SHCSR_BUSFAULTACT 0x00000002u
#define SHCSR_MEMFAULTACT 0x00000001u

/* Configurable fault status. */
enum { CFSR = 0xD28 };
#define CFSR_DIVBYZERO 0x02000000u
#define CFSR_UNALIGNED 0x01000000u
#define CFSR_NOCP 0x00080000u
#define CFSR_INVPC 0x00040000u
#define CFSR_INVSTATE 0x00020000u
#define CFSR_UNDEFINSTR 0x00010000u
#define CFSR_BFARVALID 0x00008000u
#define CFSR_LSPERR 0x00002000u
#define CFSR_STKERR 0x00001000u
#define CFSR_UNSTKERR 0x00000800u
#define CFSR_IMPRECISERR 0x00000400u
#define CFSR_PRECISERR 0x00000200u
#define CFSR_IBUSERR 0x00000100u
#define CFSR_MMARVALID 0x00000080u
#define CFSR_MLSPERR 0x00000020u
#define CFSR_MSTKERR 0x00000010u
#define CFSR_MUNSTKERR 0x00000008u
#define CFSR_DACCVIOL 0x00000002u
#define CFSR_IACCVIOL 0x00000001u

/* HardFault status. */
enum { HFSR = 0xD2C };
#define HFSR_DEBUGEVT 0x80000000u
#define HFSR_FORCED 0x40000000u
#define HFSR_VECTTBL 0x00000002u

/* Debug fault status. */
enum { DFSR = 0xD30 };
#define DFSR_EXTERNAL 0x00000010u
#define DFSR_VCATCH 0x00000008u
#define DFSR_DWTTRAP 0x00000004u
#define DFSR_BKPT 0x00000002u
#define DFSR_HALTED 0x00000001u

/* MemManage fault address. */
enum { MMFAR = 0xD34 };

/* BusFault address. */
enum { BFAR = 0xD38 };

/* Auxiliary fault status. */
enum { AFSR = 0xD3C };

/* Coprocessor access control. */
enum { CPACR = 0xD88 };
#define CPACR_STORED 0x00F00000u
#define CPACR_CP11 0x00C00000u
#define CPACR_CP11_SHIFT 22
#define CPACR_CP10 0x00300000u
#define CPACR_CP10_SHIFT 20

/* Debug halting control and status. */
enum { DHCSR = 0xDF0 };

/* Debug core register selector. */
enum { DCRSR = 0xDF4 };

/* Debug core register data. */
enum { DCRDR = 0xDF8 };

/* Debug exception and monitor control. */
enum { DEMCR = 0xDFC };
#define DEMCR_STORED 0x010F07F1u
#define DEMCR_TRCENA 0x01000000u
#define DEMCR_MON_REQ 0x00080000u
#define DEMCR_MON_STEP 0x00040000u
#define DEMCR_MON_PEND 0x00020000u
#define DEMCR_MON_EN 0x00010000u
#define DEMCR_VC_HARDERR 0x00000400u
#define DEMCR_VC_INTERR 0x00000200u
#define DEMCR_VC_BUSERR 0x00000100u
#define DEMCR_VC_STATERR 0x00000080u
#define DEMCR_VC_CHKERR 0x00000040u
#define DEMCR_VC_NOCPERR 0x00000020u
#define DEMCR_VC_MMERR 0x00000010u
#define DEMCR_VC_CORERESET 0x00000001u

/* Floating-point context control. */
enum { FPCCR = 0xF34 };
#define FPCCR_RESET 0xC0000000u
#define FPCCR_STORED 0xC0000000u
#define FPCCR_ASPEN 0x80000000u
#define FPCCR_LSPEN 0x40000000u
#define FPCCR_MONRDY 0x00000100u
#define FPCCR_BFRDY 0x00000040u
#define FPCCR_MMRDY 0x00000020u
#define FPCCR_HFRDY 0x00000010u
#define FPCCR_THREAD 0x00000008u
#define FPCCR_USER 0x00000002u
#define FPCCR_LSPACT 0x00000001u

/* Floating-point context address. */
enum { FPCAR = 0xF38 };
#define FPCAR_STORED 0xFFFFFFF8u
#define FPCAR_ADDRESS 0xFFFFFFF8u
#define FPCAR_ADDRESS_SHIFT 3

/* Floating-point default status control. */
enum { FPDSCR = 0xF3C };
#define FPDSCR_STORED 0x07C00000u
#define FPDSCR_AHP 0x04000000u
#define FPDSCR_DN 0x02000000u
#define FPDSCR_FZ 0x01000000u
#define FPDSCR_RMode 0x00C00000u
#define FPDSCR_RMode_SHIFT 22

/* Media and floating-point features 0. */
enum { MVFR0 = 0xF40 };
#define MVFR0_RESET 0x10110021u

/* Media and floating-point features 1. */
enum { MVFR1 = 0xF44 };
#define MVFR1_RESET 0x11000011u

/* All of them; -1 ends the list. */
static const int16_t SCB_OFFSETS[] = {
  0x08, 0xD00, 0xD04, 0xD08, 0xD0C, 0xD10, 0xD14, 0xD18,
  0xD1C, 0xD20, 0xD24, 0xD28, 0xD2C, 0xD30, 0xD34, 0xD38,
  0xD3C, 0xD88, 0xDF0, 0xDF4, 0xDF8, 0xDFC, 0xF34, 0xF38,
  0xF3C, 0xF40, 0xF44,
  -1,
};

#endif
