/* ValueLog: the values that watched instructions compute.
 *
 * Before each watched instruction, every register that has changed since the previous watched instruction
 * is logged with the address of that previous instruction. Therefore the result of a call is logged at the
 * call.
 */
#ifndef FCU_VALUE_LOG_H
#define FCU_VALUE_LOG_H

#include "cpu/core.h"

#define VALUE_LOG_REGISTERS 45 /* R0 to R12, S0 to S31 */
#define VALUE_LOG_LATEST 65536 /* a power of two */

/* number: 0 to 12 for R0 to R12, 13 to 44 for S0 to S31. pair: the other register of a pair of an even and
 * an odd number. */
typedef struct {
  uint32_t address, number, value, pair;
} LoggedValue;

/* The memory is Python's (value_log.py). */
typedef struct ValueLog {
  uint64_t values; /* address of LoggedValue[capacity] */
  uint32_t capacity, count, lost;
  uint32_t address; /* address of the previous watched instruction, or 0 */
  uint32_t registers[VALUE_LOG_REGISTERS];
  /* The last values by a hash of address and register. A value that was logged there before is not logged
     again. */
  uint32_t keys[VALUE_LOG_LATEST], latest[VALUE_LOG_LATEST];
} ValueLog;

void value_log_add(Core *core, uint32_t address);

#endif
