/* What the files of the driver need of each other; hostile.c explains it. */
#ifndef HOSTILE_H
#define HOSTILE_H

#include "fcu.h"

#define PROGRAMS 8

typedef struct {
  uint8_t bytes[FLASH_SIZE];
  uint32_t size;
} Program;

typedef struct {
  Chip *chip;
  uint64_t random, stream;
  uint32_t entry; /* where the stream begins */
  Program program[PROGRAMS];
  uint32_t programs;
  /* What was seen. */
  uint64_t instructions, accesses, faults, lock_ups, resets, notes, on_buses, sent, digest;
} Hostile;

extern Hostile hostile;

/* A random number below a limit; 0: any of 32 bits. */
uint32_t any(uint32_t below);

/* -- streams.c --------------------------------------------------------------------------------------------- */

/* Where something is: a register, an edge of a memory, anywhere. */
uint32_t any_address(const Chip *chip);
/* Such an address, or a number that often means something. */
uint32_t any_value(const Chip *chip);
/* Put the stream's code and its vector table into flash and RAM. */
void make_stream(Chip *chip);
/* Flash is empty again where it was put. */
void erase_stream(Chip *chip);

/* -- surroundings.c ---------------------------------------------------------------------------------------- */

extern const Host host_calls;
void connect_surroundings(Chip *chip);
/* As RCC may be set up: up to some GHz, down to a PLL that stands still. */
void set_some_clocks(Chip *chip);

#endif
