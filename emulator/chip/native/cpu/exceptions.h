/* Exceptions entered and left (ARMv7-M ARM B1.5), and the faults of the core (B1.5.14, B3.2.15). */
#ifndef FCU_EXCEPTIONS_H
#define FCU_EXCEPTIONS_H

#include "peripherals/peripheral.h"
#include "cpu/core.h"

/* status are its bits in CFSR, hard those in HFSR; the address goes to BFAR if status says that it is valid. */
typedef struct {
  int32_t exception;
  uint32_t status, hard, address;
} Fault;

#define HIGHEST_ADDRESS 0xFFFFFFFFu

typedef struct {
  int64_t thread_ps;     /* when Thread mode was last returned to */
  uint32_t exc_return;   /* of the exception being entered */
  uint32_t lowest;       /* the lowest address that the main stack has had at an exception entry */
  uint32_t locked_up;    /* the core executes nothing any more until something resets the chip */
  uint32_t locked_up_pc;
  uint8_t entering;      /* the frame has been saved, the handler not been chosen */
} Exceptions;

void exceptions_reset(Chip *chip);
/* Begin to enter the most urgent pending exception, if it may preempt what is running. Between instructions. */
bool exceptions_take_pending(Chip *chip);
/* Whether an exception is pending that may be entered now. */
bool exceptions_may_preempt(const Chip *chip);
/* Whether a pending exception ends WFI: as if PRIMASK were 0 (B1.5.19). */
bool exceptions_wake(const Chip *chip);
/* Go to the handler of the most urgent exception. */
void exceptions_finish_entry(Chip *chip);
/* SVC was executed; PC is after it. */
void exceptions_supervisor_call(Chip *chip);
/* An instruction could not be executed; PC is on it. */
void exceptions_fault(Chip *chip, Fault fault);
/* The fault that the core has stopped for; exception is 0 if it is none. */
Fault exceptions_fault_of(const Chip *chip, enum Stop stop);
/* PC has been loaded with an EXC_RETURN value. True if the core sleeps now (SLEEPONEXIT). */
bool exceptions_leave(Chip *chip);

#endif
