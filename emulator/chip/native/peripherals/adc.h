/* ADC1. */
#ifndef FCU_ADC_H
#define FCU_ADC_H

#include "peripherals/peripheral.h"

#define ADC_CHANNELS 19

/* The group whose conversion is in progress. */
enum AdcGroup { ADC_IDLE, ADC_REGULAR, ADC_INJECTED };

/* Voltages of the channels. 0 to 15: pins; 16: temperature sensor; 17: VREFINT; 18: a quarter of the backup supply. */
typedef struct {
  double volts[ADC_CHANNELS];
  uint32_t called; /* bit = channel: AdcCalls.volts() returns its voltage */
} AdcInputs;

typedef struct {
  double (*volts)(int64_t now_ps, int32_t channel);
} AdcCalls;

typedef struct {
  Peripheral peripheral;
  int32_t event;
  uint32_t registers[20]; /* by offset / 4 */
  uint32_t common;        /* CCR */
  enum AdcGroup group;
  uint8_t rank, injected_rank; /* position of the current or next conversion in its sequence */
  uint8_t left;                /* regular conversions until the next trigger, or ALL_LEFT */
  uint8_t resume;              /* regular conversions continue after the injected conversions */
  uint8_t paused;              /* the next regular conversion begins when DR is read */
  uint8_t dma_ended;           /* no more requests until firmware clears CR2.DMA (11.8.1) */
  AdcInputs inputs;
  AdcCalls calls;
} Adc;

void adc_create(Chip *chip);
/* Handle an edge of a signal (enum TimSignal) of TIM1 to TIM5. */
void adc_timer_signal(Chip *chip, int timer, int signal, bool rises);
/* Handle an event of an EXTI line. */
void adc_exti_event(Chip *chip, int line);

#endif
