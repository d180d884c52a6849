/* ValueLog: the values that watched instructions compute.
 *
 * Before a watched instruction runs, the changed registers are logged with the address of the previous
 * watched instruction. Therefore the result of a call is logged with the address of the call. Each
 * exception has its own level, so that the result of a call is not logged in an exception that
 * interrupts the call.
 */
#ifndef FCU_VALUE_LOG_H
#define FCU_VALUE_LOG_H

#include "cpu/core.h"

#define VALUE_LOG_REGISTERS 45 /* R0 to R12, S0 to S31 */
#define VALUE_LOG_LATEST 65536 /* a power of two */
#define VALUE_LOG_ADDRESSES 131072 /* a power of two: each halfword of the flash */
#define VALUE_LOG_LEVELS 8 /* deeper exceptions share the deepest level */
#define VALUE_LOG_MOST 100 /* maximum number of logged values per instruction */

/* number: 0 to 12 for R0 to R12, 13 to 44 for S0 to S31. pair: value of the other register of the even-odd
 * pair. */
typedef struct {
  uint32_t address, number, value, pair;
} LoggedValue;

/* address: the previous watched instruction of this exception, or 0. registers: their values before this
 * instruction. */
typedef struct {
  uint32_t exception, address;
  uint32_t registers[VALUE_LOG_REGISTERS];
} ValueLogLevel;

/* Python allocates this struct and the values (value_log.py). */
typedef struct ValueLog {
  uint64_t values; /* address of LoggedValue[capacity] */
  uint32_t capacity, count, lost;
  uint32_t level; /* index of the current level */
  ValueLogLevel levels[VALUE_LOG_LEVELS];
  /* A hash table of the latest logged value for each address and register. A value that equals the latest
   * value is not logged again. */
  uint32_t keys[VALUE_LOG_LATEST], latest[VALUE_LOG_LATEST];
  /* The number of values logged for each instruction; VALUE_LOG_MOST limits it, so that a loop cannot fill
   * the log. */
  uint8_t counts[VALUE_LOG_ADDRESSES];
} ValueLog;

void value_log_add(Core *core, uint32_t address);

#endif
