/* The registers and instructions of the Cortex-M4 that this firmware uses (ARMv7-M ARM B3,
 * PM0214 4). */
#ifndef CORTEX_M4_H
#define CORTEX_M4_H

#include <stdint.h>

typedef struct {
  volatile uint32_t CTRL;
  volatile uint32_t LOAD;
  volatile uint32_t VAL;
  volatile const uint32_t CALIB;
} SysTick_Type;

typedef struct {
  volatile uint32_t ISER[8];
  uint32_t RESERVED0[24];
  volatile uint32_t ICER[8];
  uint32_t RESERVED1[24];
  volatile uint32_t ISPR[8];
  uint32_t RESERVED2[24];
  volatile uint32_t ICPR[8];
  uint32_t RESERVED3[24];
  volatile const uint32_t IABR[8];
  uint32_t RESERVED4[56];
  volatile uint8_t IP[240];
} NVIC_Type;

typedef struct {
  volatile const uint32_t CPUID;
  volatile uint32_t ICSR;
  volatile uint32_t VTOR;
  volatile uint32_t AIRCR;
  volatile uint32_t SCR;
  volatile uint32_t CCR;
  volatile uint8_t SHP[12]; /* priorities of the system exceptions 4 to 15 */
  volatile uint32_t SHCSR;
  volatile uint32_t CFSR;
  volatile uint32_t HFSR;
  volatile uint32_t DFSR;
  volatile uint32_t MMFAR;
  volatile uint32_t BFAR;
  volatile uint32_t AFSR;
  volatile const uint32_t ID[18];
  volatile uint32_t CPACR;
} SCB_Type;

#define SysTick ((SysTick_Type *)0xE000E010U)
#define NVIC ((NVIC_Type *)0xE000E100U)
#define SCB ((SCB_Type *)0xE000ED00U)

#define SysTick_CTRL_ENABLE (1U << 0)
#define SysTick_CTRL_TICKINT (1U << 1)
#define SysTick_CTRL_CLKSOURCE (1U << 2)

#define SCB_AIRCR_VECTKEY (0x05FAU << 16)
#define SCB_AIRCR_PRIGROUP_Pos 8
#define SCB_AIRCR_SYSRESETREQ (1U << 2)
#define SCB_CPACR_CP10_CP11_FULL (0xFU << 20)

static inline void __disable_irq(void) { __asm volatile("cpsid i" ::: "memory"); }
static inline void __enable_irq(void) { __asm volatile("cpsie i" ::: "memory"); }
static inline void __DSB(void) { __asm volatile("dsb" ::: "memory"); }
static inline void __ISB(void) { __asm volatile("isb" ::: "memory"); }
static inline void __WFI(void) { __asm volatile("wfi" ::: "memory"); }
static inline void __NOP(void) { __asm volatile("nop"); }

static inline uint32_t __get_PRIMASK(void)
{
  uint32_t primask;
  __asm volatile("mrs %0, primask" : "=r"(primask));
  return primask;
}

static inline void __set_PRIMASK(uint32_t primask) { __asm volatile("msr primask, %0" ::"r"(primask) : "memory"); }

#endif
