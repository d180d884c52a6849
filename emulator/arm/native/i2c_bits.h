/* Bits of an I2C block's registers (RM0368 section 18.6). */
#ifndef FCU_I2C_BITS_H
#define FCU_I2C_BITS_H

#include <stdint.h>

#define PE ((int64_t)1 << 0)
#define START ((int64_t)1 << 8)
#define STOP ((int64_t)1 << 9)
#define ACK ((int64_t)1 << 10)
#define POS ((int64_t)1 << 11)
#define SWRST ((int64_t)1 << 15)
#define CR1_WRITABLE ((int64_t)0xBFFB)
#define CR1_NOT_MODELLED ((int64_t)(1 << 1 | 1 << 4 | 1 << 5 | 1 << 12)) /* SMBUS, ENARP, ENPEC, PEC */

#define SB ((int64_t)1 << 0)
#define ADDR ((int64_t)1 << 1)
#define BTF ((int64_t)1 << 2)
#define RXNE ((int64_t)1 << 6)
#define TXE ((int64_t)1 << 7)
#define BERR ((int64_t)1 << 8)
#define ARLO ((int64_t)1 << 9)
#define AF ((int64_t)1 << 10)
#define ERRORS ((int64_t)0xDF00) /* flags that software clears by writing 0 */

#define MSL ((int64_t)1 << 0)
#define BUSY ((int64_t)1 << 1)
#define TRA ((int64_t)1 << 2)

#endif
