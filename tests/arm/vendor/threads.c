/* Threads as a small real-time kernel has them: process stacks, PendSV as the switch, SVC as the start and for a
 * service, BASEPRI as the lock, S16 to S31 saved with a thread that uses them, WFI when nobody is ready.
 *
 * One thread reads the accelerometer, one computes in float, one prints; an interrupt wakes the first one.
 */
#include "lab.h"

#define STACK_WORDS 512U
#define LOCKED_PRIORITY 0x50U
#define SWITCH_PRIORITY 0xF0U
#define TIMER_PRIORITY 6U
#define ICSR_PENDSVSET (1U << 28)

typedef struct {
  uint32_t *sp; /* the first member: the switch, in assembly, stores it here */
  volatile uint32_t wakes_at; /* tick; 0: waits for a signal or is ready */
  volatile uint32_t ready;
  uint32_t switches;
} Thread;

enum { READER, COMPUTER, PRINTER, IDLE, THREADS };

static Thread threads[THREADS];
static uint32_t stacks[THREADS][STACK_WORDS] __attribute__((aligned(8)));
Thread *volatile current = &threads[IDLE];
static volatile uint32_t now_ms, started;

AxesRaw_TypeDef acc;
static volatile uint32_t reads, laps, services;
static volatile float converged;

void SVC_Handler(void);
void PendSV_Handler(void);
void ChooseThread(void);
void CountService(uint32_t *frame);
void TIM3_IRQHandler(void);

/* -- kernel ----------------------------------------------------------------------------------------------- */

static uint32_t Lock(void)
{
  uint32_t before;
  __asm volatile("mrs %0, basepri" : "=r"(before));
  __asm volatile("msr basepri, %0\n\tisb" ::"r"(LOCKED_PRIORITY) : "memory");
  return before;
}

static void Unlock(uint32_t before) { __asm volatile("msr basepri, %0" ::"r"(before) : "memory"); }

static void RequestSwitch(void)
{
  SCB->ICSR = ICSR_PENDSVSET;
  __DSB();
  __ISB();
}

/* Called by the switch with the lock held: the first one that is ready, in order of importance. */
__attribute__((used)) void ChooseThread(void)
{
  uint32_t chosen = IDLE;
  for (uint32_t n = 0; n < IDLE; n++) {
    if (threads[n].ready) {
      chosen = n;
      break;
    }
  }
  current = &threads[chosen];
  current->switches++;
}

__attribute__((naked)) void PendSV_Handler(void)
{
  __asm volatile("mrs r0, psp\n\t"
                 "isb\n\t"
                 "ldr r3, =current\n\t"
                 "ldr r2, [r3]\n\t"
                 "tst lr, #0x10\n\t"
                 "it eq\n\t"
                 "vstmdbeq r0!, {s16-s31}\n\t"
                 "stmdb r0!, {r4-r11, lr}\n\t"
                 "str r0, [r2]\n\t"
                 "push {r3, lr}\n\t"
                 "mov r0, %0\n\t"
                 "msr basepri, r0\n\t"
                 "dsb\n\t"
                 "isb\n\t"
                 "bl ChooseThread\n\t"
                 "mov r0, #0\n\t"
                 "msr basepri, r0\n\t"
                 "pop {r3, lr}\n\t"
                 "ldr r1, [r3]\n\t"
                 "ldr r0, [r1]\n\t"
                 "ldmia r0!, {r4-r11, lr}\n\t"
                 "tst lr, #0x10\n\t"
                 "it eq\n\t"
                 "vldmiaeq r0!, {s16-s31}\n\t"
                 "msr psp, r0\n\t"
                 "isb\n\t"
                 "bx lr\n\t"
                 ".ltorg" ::"i"(LOCKED_PRIORITY));
}

/* From the main stack it starts the first thread and opens the lock; from a thread's it is a service. */
__attribute__((naked)) void SVC_Handler(void)
{
  __asm volatile("tst lr, #4\n\t"
                 "bne 1f\n\t"
                 "ldr r3, =current\n\t"
                 "ldr r1, [r3]\n\t"
                 "ldr r0, [r1]\n\t"
                 "ldmia r0!, {r4-r11, lr}\n\t"
                 "msr psp, r0\n\t"
                 "mov r0, #0\n\t"
                 "msr basepri, r0\n\t"
                 "isb\n\t"
                 "bx lr\n"
                 "1:\n\t"
                 "mrs r0, psp\n\t"
                 "b CountService\n\t"
                 ".ltorg");
}

__attribute__((used)) void CountService(uint32_t *frame)
{
  const uint8_t *code = (const uint8_t *)frame[6];
  services += code[-2]; /* the number in the instruction */
  frame[0] += services;
}

static uint32_t Service(uint32_t value)
{
  register uint32_t r0 __asm("r0") = value;
  __asm volatile("svc #1" : "+r"(r0)::"memory");
  return r0;
}

static void Prepare(uint32_t number, void (*entry)(void))
{
  uint32_t *sp = &stacks[number][STACK_WORDS] - 17;
  sp[8] = 0xFFFFFFFD;       /* LR: thread mode, process stack, no floating-point frame */
  sp[15] = (uint32_t)entry; /* PC */
  sp[16] = 1U << 24;        /* xPSR */
  threads[number].sp = sp;
  threads[number].ready = 1;
}

static void Sleep(uint32_t ms)
{
  uint32_t before = Lock();
  current->wakes_at = now_ms + ms;
  current->ready = 0;
  RequestSwitch();
  Unlock(before);
}

static void WaitForSignal(void)
{
  uint32_t before = Lock();
  current->ready = 0;
  RequestSwitch();
  Unlock(before);
}

void SysTick_Handler(void);
void SysTick_Handler(void)
{
  HAL_IncTick();
  if (!started) {
    return;
  }
  now_ms++;
  for (uint32_t n = 0; n < IDLE; n++) {
    if (threads[n].wakes_at != 0U && threads[n].wakes_at <= now_ms) {
      threads[n].wakes_at = 0;
      threads[n].ready = 1;
    }
  }
  SCB->ICSR = ICSR_PENDSVSET;
}

void TIM3_IRQHandler(void)
{
  TIM3->SR = ~TIM_SR_UIF;
  threads[READER].ready = 1;
  SCB->ICSR = ICSR_PENDSVSET;
}

/* -- threads ---------------------------------------------------------------------------------------------- */

static void ReadForEver(void)
{
  while (1) {
    WaitForSignal();
    if (LSM6DSL_X_GetAxes(&acc) == COMPONENT_OK) {
      reads++;
    }
  }
}

/* Newton's square root of 2, with sixteen values alive across switches. */
static void ComputeForEver(void)
{
  while (1) {
    float values[16];
    for (uint32_t n = 0; n < 16U; n++) {
      values[n] = 1.0f + (float)n;
    }
    for (uint32_t round = 0; round < 12U; round++) {
      for (uint32_t n = 0; n < 16U; n++) {
        values[n] = 0.5f * (values[n] + 2.0f / values[n]);
      }
    }
    float sum = 0;
    for (uint32_t n = 0; n < 16U; n++) {
      sum += values[n];
    }
    converged = sum / 16.0f;
    if (++laps % 64U == 0U) {
      Sleep(2);
    }
  }
}

static void PrintForEver(void)
{
  while (1) {
    Sleep(10);
    uint32_t answer = Service(1000);
    PRINTF("reads %lu z %ld root %.5f answer %lu\n", reads, acc.AXIS_Z, (double)converged, answer);
  }
}

static void IdleForEver(void)
{
  while (1) {
    __WFI();
  }
}

int main(void)
{
  HAL_Init();
  SystemClock_Config();
  MX_GPIO_Init();
  MX_USART1_UART_Init();
  MX_SensorBus_Init();
  LSM6DSL_X_Init();
  LSM6DSL_FlightSetup();
  HAL_Delay(40);
  Prepare(READER, ReadForEver);
  Prepare(COMPUTER, ComputeForEver);
  Prepare(PRINTER, PrintForEver);
  Prepare(IDLE, IdleForEver);
  HAL_RCC_Enable(&RCC->APB1ENR, BIT(1));
  TIM3->PSC = 83;
  TIM3->ARR = 2499; /* 400 Hz */
  TIM3->EGR = TIM_EGR_UG;
  TIM3->SR = 0;
  TIM3->DIER = TIM_DIER_UIE;
  TIM3->CR1 = TIM_CR1_CEN;
  HAL_NVIC_SetPriority(TIM3_IRQn, TIMER_PRIORITY, 0);
  HAL_NVIC_EnableIRQ(TIM3_IRQn);
  SCB->SHP[10] = SWITCH_PRIORITY;
  SCB->SHP[11] = SWITCH_PRIORITY;
  Lock();
  started = 1;
  __asm volatile("svc #0");
  while (1) {
  }
}
