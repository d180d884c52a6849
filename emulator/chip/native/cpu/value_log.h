/* ValueLog: the values that watched instructions compute.
 *
 * Before a watched instruction is executed, each register that has changed since the previous watched one is logged
 * with that one's address. So the result of a call is logged at the call.
 */
#ifndef FCU_VALUE_LOG_H
#define FCU_VALUE_LOG_H

#include "cpu/core.h"

#define VALUE_LOG_REGISTERS 45 /* R0 to R12, S0 to S31 */
#define VALUE_LOG_LATEST 65536 /* a power of two */

/* number: 0 to 12 for R0 to R12, 13 to 44 for S0 to S31. pair: the other register of an even and odd pair. */
typedef struct {
  uint32_t address, number, value, pair;
} LoggedValue;

/* The memory is Python's (value_log.py). */
typedef struct ValueLog {
  uint64_t values; /* address of LoggedValue[capacity] */
  uint32_t capacity, count, lost;
  uint32_t address; /* the previous watched instruction; 0: none */
  uint32_t registers[VALUE_LOG_REGISTERS];
  /* By a hash of address and register: a value that was logged there before is not logged again. */
  uint32_t keys[VALUE_LOG_LATEST], latest[VALUE_LOG_LATEST];
} ValueLog;

void value_log_add(Core *core, uint32_t address);

#endif
