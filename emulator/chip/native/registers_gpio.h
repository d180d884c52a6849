/* General-purpose inputs and outputs (RM0368 section 8.4).
 *
 * Made of emulator/chip/registers/gpio.py, by python -m fcu_emulator.emulator.chip.registers. */
#ifndef FCU_REGISTERS_GPIO_H
#define FCU_REGISTERS_GPIO_H

#include <stdint.h>

/* Mode. */
enum { MODER = 0x00 };
#define MODER_MODERx(x) (0x00000003u << 2 * (x))

/* Output type. */
enum { OTYPER = 0x04 };
#define OTYPER_STORED 0x0000FFFFu
#define OTYPER_OTx(x) (0x00000001u << 1 * (x))

/* Output speed. */
enum { OSPEEDR = 0x08 };
#define OSPEEDR_OSPEEDRx(x) (0x00000003u << 2 * (x))

/* Pull-up and pull-down resistors. */
enum { PUPDR = 0x0C };
#define PUPDR_PUPDRx(x) (0x00000003u << 2 * (x))

/* Input data. */
enum { IDR = 0x10 };
#define IDR_IDRx(x) (0x00000001u << 1 * (x))

/* Output data. */
enum { ODR = 0x14 };
#define ODR_STORED 0x0000FFFFu
#define ODR_ODRx(x) (0x00000001u << 1 * (x))

/* Bit set and reset of ODR. */
enum { BSRR = 0x18 };
#define BSRR_BRx(x) (0x00010000u << 1 * (x))
#define BSRR_BSx(x) (0x00000001u << 1 * (x))

/* Configuration lock. */
enum { LCKR = 0x1C };
#define LCKR_STORED 0x0001FFFFu
#define LCKR_LCKK 0x00010000u
#define LCKR_LCKx(x) (0x00000001u << 1 * (x))

/* Alternate function, pins 0 to 7. */
enum { AFRL = 0x20 };
#define AFRL_AFRLx(x) (0x0000000Fu << 4 * (x))

/* Alternate function, pins 8 to 15. */
enum { AFRH = 0x24 };
#define AFRH_AFRHx(x) (0x0000000Fu << 4 * ((x) - 8))

/* All of them; -1 ends the list. */
static const int16_t GPIO_OFFSETS[] = {
  0x00, 0x04, 0x08, 0x0C, 0x10, 0x14, 0x18, 0x1C,
  0x20, 0x24,
  -1,
};

/* The bits that each block has, by offset / 4. */
static const uint32_t GPIO_EXISTING[6][10] = {
  { /* GPIOA */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
  { /* GPIOB */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
  { /* GPIOC */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
  { /* GPIOD */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
  { /* GPIOE */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
  { /* GPIOH */
    [0] = 0xFFFFFFFF, [1] = 0xFFFF, [2] = 0xFFFFFFFF, [3] = 0xFFFFFFFF, [4] = 0xFFFF,
    [5] = 0xFFFF, [6] = 0xFFFFFFFF, [7] = 0x1FFFF, [8] = 0xFFFFFFFF, [9] = 0xFFFFFFFF,
  },
};

/* Values after reset, by offset / 4. */
static const uint32_t GPIO_RESETS[6][10] = {
  { /* GPIOA */
    [0] = 0xA8000000, [2] = 0xC000000, [3] = 0x64000000,
  },
  { /* GPIOB */
    [0] = 0x280, [2] = 0xC0, [3] = 0x100,
  },
  { /* GPIOC */
    0,
  },
  { /* GPIOD */
    0,
  },
  { /* GPIOE */
    0,
  },
  { /* GPIOH */
    0,
  },
};

#endif
