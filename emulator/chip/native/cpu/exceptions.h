/* Exception entry and return (ARMv7-M ARM B1.5), and the faults of the core (B1.5.14, B3.2.15). */
#ifndef FCU_EXCEPTIONS_H
#define FCU_EXCEPTIONS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

/* status contains its bits in CFSR, hard those in HFSR; the address goes to BFAR if status says that it is valid. */
typedef struct {
  int32_t exception;
  uint32_t cfsr, hfsr, address;
} Fault;

#define HIGHEST_ADDRESS 0xFFFFFFFFu

typedef struct {
  int64_t thread_ps;     /* the time of the last return to Thread mode */
  uint32_t exc_return;   /* of the exception being entered */
  uint32_t lowest_msp;       /* the lowest address of the main stack at an exception entry */
  uint32_t locked_up;    /* the core executes nothing until a reset of the chip */
  uint32_t locked_up_pc;
  uint8_t entering;      /* the frame is saved, the handler not yet chosen */
} Exceptions;

void exceptions_reset(Chip *chip);
/* Begin to enter the most urgent pending exception, if it may preempt the current code. Between instructions. */
bool exceptions_take_pending(Chip *chip);
/* Return true if a pending exception may be entered now. */
bool exceptions_may_preempt(const Chip *chip);
/* Return true if a pending exception ends WFI: as if PRIMASK were 0 (B1.5.19). */
bool exceptions_end_wfi(const Chip *chip);
/* Start the handler of the most urgent exception. */
void exceptions_finish_entry(Chip *chip);
/* SVC was executed; PC is after it. */
void exceptions_supervisor_call(Chip *chip);
/* An instruction could not be executed; PC is on it. */
void exceptions_fault(Chip *chip, Fault fault);
/* Return the fault for which the core stopped; exception is 0 if the reason was not a fault. */
Fault exceptions_fault_for(const Chip *chip, enum Stop stop);
/* PC has been loaded with an EXC_RETURN value. True if the core sleeps now (SLEEPONEXIT). */
bool exceptions_return(Chip *chip);

#endif
