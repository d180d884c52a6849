/* System timer (ARMv7-M ARM B3.3, PM0214 4.5); offsets in the system control space.
 *
 * Made of emulator/chip/registers/systick.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_SYSTICK_H
#define FCU_REGISTERS_SYSTICK_H

#include <stdint.h>

/* Control and status. */
enum { SYST_CSR = 0x10 };
#define SYST_CSR_STORED 0x00000007u
#define SYST_CSR_COUNTFLAG 0x00010000u
#define SYST_CSR_CLKSOURCE 0x00000004u
#define SYST_CSR_TICKINT 0x00000002u
#define SYST_CSR_ENABLE 0x00000001u

/* Reload value. */
enum { SYST_RVR = 0x14 };
#define SYST_RVR_STORED 0x00FFFFFFu
#define SYST_RVR_RELOAD 0x00FFFFFFu
#define SYST_RVR_RELOAD_SHIFT 0

/* Current value; any write clears it. */
enum { SYST_CVR = 0x18 };
#define SYST_CVR_STORED 0x00FFFFFFu
#define SYST_CVR_CURRENT 0x00FFFFFFu
#define SYST_CVR_CURRENT_SHIFT 0

/* Calibration value. */
enum { SYST_CALIB = 0x1C };
#define SYST_CALIB_RESET 0x40002904u
#define SYST_CALIB_NOREF 0x80000000u
#define SYST_CALIB_SKEW 0x40000000u
#define SYST_CALIB_TENMS 0x00FFFFFFu
#define SYST_CALIB_TENMS_SHIFT 0

/* All of them; -1 ends the list. */
static const int16_t SYSTICK_OFFSETS[] = {
  0x10, 0x14, 0x18, 0x1C,
  -1,
};

#endif
