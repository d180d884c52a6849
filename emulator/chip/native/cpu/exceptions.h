/* Exception entry and return (ARMv7-M ARM B1.5), and faults (B1.5.14, B3.2.15). */
#ifndef FCU_EXCEPTIONS_H
#define FCU_EXCEPTIONS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

/* Bits of CFSR and HFSR, and BFAR if cfsr says that it is valid. */
typedef struct {
  int32_t exception;
  uint32_t cfsr, hfsr, address;
} Fault;

#define HIGHEST_ADDRESS 0xFFFFFFFFu

typedef struct {
  int64_t thread_ps;
  int64_t switched_ps;   /* time of the latest return to a thread other than the interrupted one */
  uint32_t thread_frame; /* frame of the interrupted thread on the process stack; 0: on the main stack */
  uint32_t exc_return;
  uint32_t lowest_msp; /* lowest main stack pointer after an exception entry */
  uint32_t locked_up;
  uint32_t locked_up_pc;
  uint8_t entering; /* the frame is saved, but the handler is not chosen yet */
} Exceptions;

void exceptions_reset(Chip *chip);
/* Called between instructions. Begin an entry if a pending exception preempts. */
bool exceptions_take_pending(Chip *chip);
bool exceptions_may_preempt(const Chip *chip);
/* Return whether a pending exception ends WFI; PRIMASK counts as 0 (B1.5.19). */
bool exceptions_end_wfi(const Chip *chip);
void exceptions_finish_entry(Chip *chip);
void exceptions_supervisor_call(Chip *chip);
void exceptions_fault(Chip *chip, Fault fault);
/* Return the fault for a stop; its exception is 0 if the stop is not a fault. */
Fault exceptions_fault_for(const Chip *chip, enum Stop stop);
/* Return from an exception; PC contains EXC_RETURN. Return true if the core then sleeps (sleep on exit). */
bool exceptions_return(Chip *chip);

#endif
