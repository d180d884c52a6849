/* Two threads, each with a process stack. PendSV switches them at each tick, as in a preemptive kernel.
 *
 * runnable: bit n is thread n. With both bits set, the threads take turns; with one bit set, only this thread runs.
 */
#ifndef THREADS_H
#define THREADS_H

#include "boot.h"

#define SWITCH_PRIORITY 0xF0U
#define PENDSVSET (1U << 28)
#define WORDS 256U

static uint64_t stacks[3][WORDS / 2U]; /* the last one is for the first switch */
static uint32_t *saved[2];
static volatile int running = -1;
static volatile uint32_t runnable = 1U;

static inline void Switch(void)
{
  SCB->ICSR = PENDSVSET;
  __DSB();
  __ISB();
}

__attribute__((used)) static uint32_t *NextThread(uint32_t *stack)
{
  if (running >= 0) {
    saved[running] = stack;
  }
  int other = running == 0 ? 1 : 0;
  running = runnable >> other & 1U ? other : 1 - other;
  return saved[running];
}

__attribute__((naked)) void PendSV_Handler(void)
{
  __asm volatile("mrs r0, psp\n\ttst lr, #0x10\n\tit eq\n\tvstmdbeq r0!, {s16-s31}\n\tstmdb r0!, {r4-r11, lr}\n\t"
                 "bl NextThread\n\t"
                 "ldmia r0!, {r4-r11, lr}\n\ttst lr, #0x10\n\tit eq\n\tvldmiaeq r0!, {s16-s31}\n\t"
                 "msr psp, r0\n\tbx lr");
}

static inline void Create(int thread, void (*function)(void))
{
  uint32_t *frame = (uint32_t *)&stacks[thread + 1] - 17;
  frame[8] = 0xFFFFFFFDU; /* EXC_RETURN: Thread mode, process stack */
  frame[15] = (uint32_t)function;
  frame[16] = 1U << 24; /* xPSR.T */
  saved[thread] = frame;
}

/* TIM9 at 800 Hz switches the threads. */
void HAL_TIM_PeriodElapsedCallback(TIM_HandleTypeDef *htim)
{
  UNUSED(htim);
  SCB->ICSR = PENDSVSET;
}

static inline void StartThreads(void)
{
  SCB->SHP[10] = SWITCH_PRIORITY;
  __asm volatile("msr psp, %0" ::"r"(&stacks[2][WORDS / 2U]));
  __disable_irq(); /* the first switch must not come before the timer runs */
  start_timer();
  __enable_irq();
  for (;;) {
    Switch();
  }
}

#endif
