/* Registers of the sensors, which firmware reads without a call of Python.
 *
 * sensors/shared_registers.py explains the memory that Python and C share. C calls fill() in Python when a train of
 * samples ends, and bank() after each change of a sensor's version. The bus calls Python for registers that are
 * read live.
 *
 * A bus master sets the target's position, and calls target_read() for each byte.
 */
#ifndef FCU_SENSOR_REGISTERS_H
#define FCU_SENSOR_REGISTERS_H

#include "peripherals/peripheral.h"

#define TARGETS 8
#define SUBADDRESSES 128
#define OUTPUTS 3
#define OUTPUT_WIDTH 6
#define TRAIN_AHEAD 256
#define POSITION_SYNCED ((int64_t)-1) /* position: only Python knows the sub-address */

enum RegisterAccess { ACCESS_LIVE, ACCESS_MEMORY, ACCESS_STATUS, ACCESS_OUTPUT };

typedef struct {
  uint64_t version;    /* the sensor's version when Python filled the train */
  int64_t at, count;   /* indices of the current sample and the final sample */
  int64_t taken;       /* number of samples that C has passed without a report to Python */
  int64_t times[TRAIN_AHEAD + 1]; /* [n]: time when sample n + 1 replaces sample n */
  uint64_t holds[OUTPUT_WIDTH], releases[OUTPUT_WIDTH];
  uint8_t samples[(TRAIN_AHEAD + 1) * OUTPUT_WIDTH];
  uint8_t keep[OUTPUT_WIDTH];
  uint8_t first, width;
  uint8_t status, flags, overrun_shift;
  uint8_t is_stale, is_live;
} Train;

typedef struct {
  uint64_t held;   /* bytes held by block data update; bit number: the lowest six bits of the sub-address */
  uint64_t memory; /* address of the registers' bytes */
  uint8_t next[SUBADDRESSES];
  uint8_t access[SUBADDRESSES]; /* enum RegisterAccess; ACCESS_OUTPUT + n for train n */
  uint64_t trains[OUTPUTS]; /* addresses; 0: none */
} Bank;

typedef struct {
  /* Return the address of the sensor's bank; 0: Python handles reads. BANK_REFUSED: the sensor does not answer. */
  int64_t (*bank)(int64_t now_ps, int32_t target);
  /* Fill the train with the present sample and the following ones, or set is_live. */
  void (*fill)(int64_t now_ps, int32_t target, int32_t train);
} TargetCalls;

#define BANK_REFUSED ((int64_t)-1)

typedef struct {
  const uint64_t *version;
  uint64_t known; /* sensor version for which this struct is valid */
  Bank *bank;     /* NULL: Python handles reads */
  uint8_t increment_bit;
} Target;

/* Python accesses the first member (sensor_registers.py). */
typedef struct {
  int64_t positions[TARGETS]; /* next sub-address of each target, or POSITION_SYNCED */
  TargetCalls calls;
  int32_t count;
  Target target[TARGETS];
} SensorRegisters;

void sensor_registers_create(Chip *chip);
/* Return true if the sensor acknowledges its address. */
bool target_answers(Chip *chip, Target *target);
/* Return true if C knows the target's position and has its bank. */
bool target_is_readable(Chip *chip, const Target *target);
void target_set_position(Chip *chip, const Target *target, uint8_t subaddress);
/* Read the byte at the position; return false if Python must read it. */
bool target_read(Chip *chip, Target *target, uint8_t *byte);
/* Get the target's bank from Python again before the next read, because the bus has changed. */
void target_invalidate(Target *target);

#endif
