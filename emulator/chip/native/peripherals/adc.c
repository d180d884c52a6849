/* ADC1: regular and injected conversions, their triggers, and the analog watchdog (RM0368 section 11).
 *
 * A conversion takes its sampling time and one cycle for each bit (11.5). The voltage is read at its end. If a sequence
 * of one channel is converted continuously, and only reads of DR use its results, the converter pauses at EOC. Then a
 * read of DR converts the voltage that is present at this time; firmware cannot detect the difference. An unconnected
 * input reads 0 V.
 *
 * Approximated: a conversion starts without delay after its trigger, and after ADON; the analog watchdog and JOFRx use
 * results in their resolution, because the manual describes 12 bits only.
 */
#include "fcu.h"

#include <math.h>
#include <string.h>

#include "generated/registers_adc.h"

#define REGISTER(adc, offset) ((adc)->registers[(offset) >> 2])
#define INTERRUPT 18 /* RM0368 table 38 */
#define VDDA_V 3.3
#define FULL_SCALE 4095
#define ALL_LEFT 255

enum { TEMPERATURE = 16, VREFINT = 17, VBAT = 18, LAST_CHANNEL = VBAT };
enum { RISING = 1, FALLING = 2 }; /* EXTEN, JEXTEN */
#define EXTI_SOURCE 15            /* EXTSEL and JEXTSEL */
#define REGULAR_LINE 11
#define INJECTED_LINE 15

/* Timers 1 to 5 and their signals by EXTSEL and JEXTSEL (11.12.3). Timer 0: reserved, or EXTI_SOURCE. */
typedef struct {
  uint8_t timer, signal;
} Source;
static const Source REGULAR_SOURCES[16] = {
  {1, TIM_CC1}, {1, TIM_CC2},  {1, TIM_CC3}, {2, TIM_CC2}, {2, TIM_CC3}, {2, TIM_CC4}, {2, TIM_TRGO},
  {3, TIM_CC1}, {3, TIM_TRGO}, {4, TIM_CC4}, {5, TIM_CC1}, {5, TIM_CC2}, {5, TIM_CC3},
};
static const Source INJECTED_SOURCES[16] = {
  {1, TIM_CC4}, {1, TIM_TRGO}, {2, TIM_CC1}, {2, TIM_TRGO}, {3, TIM_CC2}, {3, TIM_CC4},
  {4, TIM_CC1}, {4, TIM_CC2},  {4, TIM_CC3}, {4, TIM_TRGO}, {5, TIM_CC4}, {5, TIM_TRGO},
};

static uint32_t cr1_of(const Adc *adc) { return REGISTER(adc, CR1); }

static uint32_t cr2_of(const Adc *adc) { return REGISTER(adc, CR2); }

static void update_irq(Adc *adc) {
  uint32_t sr = REGISTER(adc, SR), cr1 = cr1_of(adc);
  bool active = (sr & SR_EOC && cr1 & CR1_EOCIE) || (sr & SR_JEOC && cr1 & CR1_JEOCIE) ||
                (sr & SR_AWD && cr1 & CR1_AWDIE) || (sr & SR_OVR && cr1 & CR1_OVRIE);
  peripheral_set_irq(&adc->peripheral, INTERRUPT, active);
}

/* -- sequences (11.3.8, 11.3.9) --------------------------------------------------------------------------- */

static int length_of(const Adc *adc) {
  return cr1_of(adc) & CR1_SCAN ? (int)FIELD(REGISTER(adc, SQR1), SQR1_L) + 1 : 1;
}

static int injected_length_of(const Adc *adc) {
  return cr1_of(adc) & CR1_SCAN ? (int)FIELD(REGISTER(adc, JSQR), JSQR_JL) + 1 : 1;
}

static int channel_at(uint32_t sequence, uint32_t place) {
  uint32_t channel = sequence >> 5 * place & 0x1F;
  return channel < LAST_CHANNEL ? (int)channel : LAST_CHANNEL;
}

static int regular_channel(const Adc *adc) {
  static const uint8_t REGISTERS[] = {SQR3, SQR2, SQR1};
  return channel_at(REGISTER(adc, REGISTERS[adc->rank / 6]), adc->rank % 6);
}

/* A sequence of n conversions begins with JSQ(5 - n) (11.12.12). */
static int injected_channel(const Adc *adc) {
  uint32_t place = 3 - FIELD(REGISTER(adc, JSQR), JSQR_JL) + adc->injected_rank;
  return channel_at(REGISTER(adc, JSQR), place & 3);
}

/* -- results (11.3.7, 11.4, 11.7, 11.9, 11.10) ------------------------------------------------------------ */

/* The STM32F401 has its temperature sensor on channels 16 and 18; ST's HAL for this chip converts channel 16. */
static double volts_of(const Adc *adc, int channel) {
  const AdcInputs *inputs = &adc->inputs;
  bool sensors = adc->common & CCR_TSVREFE;
  if (channel == VBAT && adc->common & CCR_VBATE) {
    return inputs->volts[VBAT];
  }
  if (channel == TEMPERATURE || channel == VBAT) {
    return sensors ? inputs->volts[TEMPERATURE] : 0;
  }
  if (channel == VREFINT) {
    return sensors ? inputs->volts[VREFINT] : 0;
  }
  bool called = inputs->called >> channel & 1;
  return called ? adc->calls.volts(adc->peripheral.chip->now_ps, channel) : inputs->volts[channel];
}

static int resolution_of(const Adc *adc) { return (int)FIELD(cr1_of(adc), CR1_RES); }

static int convert(const Adc *adc, int channel) {
  double code = rint(volts_of(adc, channel) / VDDA_V * FULL_SCALE);
  int limited = code > FULL_SCALE ? FULL_SCALE : code > 0 ? (int)code : 0;
  return limited >> 2 * resolution_of(adc);
}

/* Results of 6 bits are aligned to a byte. The bit above an injected result is its sign. */
static uint32_t aligned(const Adc *adc, int code, int sign_bits) {
  int resolution = resolution_of(adc);
  int shift = cr2_of(adc) & CR2_ALIGN ? (resolution < 3 ? 4 + 2 * resolution : 2) - sign_bits : 0;
  return ((uint32_t)code << shift) & 0xFFFF;
}

static void watch(Adc *adc, int channel, int code, uint32_t enabled) {
  bool is_watched = !(cr1_of(adc) & CR1_AWDSGL) || (int)FIELD(cr1_of(adc), CR1_AWDCH) == channel;
  if (cr1_of(adc) & enabled && is_watched && (code > (int)REGISTER(adc, HTR) || code < (int)REGISTER(adc, LTR))) {
    REGISTER(adc, SR) |= SR_AWD;
  }
}

static void store_regular(Adc *adc) {
  int channel = regular_channel(adc), code = convert(adc, channel);
  REGISTER(adc, DR) = aligned(adc, code, 0);
  watch(adc, channel, code, CR1_AWDEN);
}

static void store_injected(Adc *adc) {
  int channel = injected_channel(adc), code = convert(adc, channel), number = adc->injected_rank + 1;
  REGISTER(adc, JDRx(number)) = aligned(adc, code - (int)REGISTER(adc, JOFRx(number)), 1);
  watch(adc, channel, code, CR1_JAWDEN);
}

/* -- conversions ------------------------------------------------------------------------------------------ */

static void begin(Adc *adc, enum AdcGroup group) {
  static const uint16_t SAMPLING[] = {3, 15, 28, 56, 84, 112, 144, 480};
  static const uint8_t BITS[] = {12, 10, 8, 6};
  Chip *chip = adc->peripheral.chip;
  int64_t hz = chip->clocks.pclk2_hz, divider = 2 * (FIELD(adc->common, CCR_ADCPRE) + 1);
  int channel = group == ADC_INJECTED ? injected_channel(adc) : regular_channel(adc);
  uint32_t smpr = channel < 10 ? REGISTER(adc, SMPR2) >> 3 * channel : REGISTER(adc, SMPR1) >> 3 * (channel - 10);
  int64_t cycles = SAMPLING[smpr & 7] + BITS[resolution_of(adc)];
  adc->group = group;
  if (hz > 0) {
    event_schedule(chip, adc->event, chip->now_ps + cycles * divider * PS_PER_S / hz);
  }
}

/* An overrun stops the regular group until software clears OVR (11.8.1). */
static void begin_regular(Adc *adc) {
  adc->paused = false;
  if (REGISTER(adc, SR) & SR_OVR) {
    return;
  }
  if (adc->group == ADC_INJECTED) {
    adc->resume = true;
  } else {
    begin(adc, ADC_REGULAR);
  }
}

static void stop(Adc *adc) {
  event_cancel(adc->peripheral.chip, adc->event);
  adc->group = ADC_IDLE;
  adc->paused = adc->resume = false;
  adc->rank = adc->injected_rank = 0;
}

static void start_regular(Adc *adc) {
  uint32_t cr1 = cr1_of(adc);
  if (!(cr2_of(adc) & CR2_ADON) || adc->group == ADC_REGULAR || adc->resume) {
    return;
  }
  REGISTER(adc, SR) |= SR_STRT;
  adc->rank = cr1 & CR1_DISCEN ? adc->rank : 0;
  adc->left = cr1 & CR1_DISCEN ? (uint8_t)(FIELD(cr1, CR1_DISCNUM) + 1) : ALL_LEFT;
  begin_regular(adc);
}

/* An injected group interrupts a regular conversion, which is repeated afterwards (11.3.9). */
static void start_injected(Adc *adc) {
  if (!(cr2_of(adc) & CR2_ADON) || adc->group == ADC_INJECTED) {
    return;
  }
  adc->resume |= adc->group == ADC_REGULAR;
  REGISTER(adc, SR) |= SR_JSTRT;
  adc->injected_rank = cr1_of(adc) & CR1_JDISCEN ? adc->injected_rank : 0;
  begin(adc, ADC_INJECTED);
}

/* Return whether anything except a read of DR uses the regular results. */
static bool is_result_used(const Adc *adc) {
  const uint32_t users = CR1_EOCIE | CR1_AWDEN | CR1_JAUTO | CR1_DISCEN;
  return cr2_of(adc) & (CR2_DMA | CR2_EOCS) || cr1_of(adc) & users || length_of(adc) > 1;
}

/* A discontinuous subgroup ends with the final conversion of the sequence, even if it is shorter (11.3.10). */
static void continue_regular(Adc *adc, bool is_last) {
  bool continuous = cr2_of(adc) & CR2_CONT && adc->left == ALL_LEFT;
  adc->rank = is_last ? 0 : adc->rank + 1;
  adc->left -= adc->left != ALL_LEFT;
  if (is_last && cr1_of(adc) & CR1_JAUTO) {
    adc->resume = continuous;
    start_injected(adc);
  } else if (is_last && continuous && !is_result_used(adc)) {
    adc->paused = true;
  } else if (is_last ? continuous : adc->left > 0) {
    begin_regular(adc);
  }
}

/* Without DDS, requests end after the final transfer (11.8.1). */
static void request_dma(Adc *adc) {
  Chip *chip = adc->peripheral.chip;
  bool is_final = dma_remaining(chip, REQUEST_ADC1) == 1;
  if (dma_request(chip, REQUEST_ADC1)) {
    adc->dma_ended = is_final && !(cr2_of(adc) & CR2_DDS);
  }
}

static void end_regular(Adc *adc) {
  bool is_last = adc->rank + 1 >= length_of(adc), is_kept = cr2_of(adc) & (CR2_DMA | CR2_EOCS);
  if (is_kept && REGISTER(adc, SR) & SR_EOC) {
    REGISTER(adc, SR) |= SR_OVR; /* this result is lost (11.8.1) */
    return;
  }
  store_regular(adc);
  REGISTER(adc, SR) |= is_last || is_kept || cr1_of(adc) & CR1_DISCEN ? SR_EOC : 0;
  continue_regular(adc, is_last);
  if (cr2_of(adc) & CR2_DMA && !adc->dma_ended) {
    request_dma(adc);
  }
}

static void end_injected(Adc *adc) {
  bool is_last = adc->injected_rank + 1 >= injected_length_of(adc);
  store_injected(adc);
  adc->injected_rank = is_last ? 0 : adc->injected_rank + 1;
  REGISTER(adc, SR) |= is_last ? SR_JEOC : 0;
  if (!is_last && !(cr1_of(adc) & CR1_JDISCEN)) {
    begin(adc, ADC_INJECTED);
  } else if (adc->resume) {
    adc->resume = false;
    begin_regular(adc);
  }
}

static void on_event(Peripheral *peripheral) {
  Adc *adc = (Adc *)peripheral;
  enum AdcGroup ended = adc->group;
  adc->group = ADC_IDLE;
  if (ended == ADC_INJECTED) {
    end_injected(adc);
  } else {
    end_regular(adc);
  }
  update_irq(adc);
}

/* -- triggers (11.6) -------------------------------------------------------------------------------------- */

static bool is_triggered(Source source, uint32_t edges, int timer, int signal, bool rises) {
  return edges & (rises ? RISING : FALLING) && source.timer == timer && source.signal == signal;
}

void adc_timer_signal(Chip *chip, int timer, int signal, bool rises) {
  Adc *adc = &chip->adc;
  uint32_t cr2 = cr2_of(adc);
  if (is_triggered(INJECTED_SOURCES[FIELD(cr2, CR2_JEXTSEL)], FIELD(cr2, CR2_JEXTEN), timer, signal, rises)) {
    start_injected(adc);
  }
  if (is_triggered(REGULAR_SOURCES[FIELD(cr2, CR2_EXTSEL)], FIELD(cr2, CR2_EXTEN), timer, signal, rises)) {
    start_regular(adc);
  }
}

/* EXTI selects the edges of the pin. Its event is a pulse, which has both edges. */
void adc_exti_event(Chip *chip, int line) {
  Adc *adc = &chip->adc;
  uint32_t cr2 = cr2_of(adc);
  if (line == INJECTED_LINE && FIELD(cr2, CR2_JEXTEN) && FIELD(cr2, CR2_JEXTSEL) == EXTI_SOURCE) {
    start_injected(adc);
  }
  if (line == REGULAR_LINE && FIELD(cr2, CR2_EXTEN) && FIELD(cr2, CR2_EXTSEL) == EXTI_SOURCE) {
    start_regular(adc);
  }
}

static void listen(Chip *chip, uint32_t edges, Source source) {
  if (edges && source.timer) {
    timers_listen(chip, source.timer, source.signal);
  }
}

static void triggers_changed(Adc *adc) {
  Chip *chip = adc->peripheral.chip;
  uint32_t cr2 = cr2_of(adc);
  timers_ignore_all(chip);
  if (cr2 & CR2_ADON) {
    listen(chip, FIELD(cr2, CR2_EXTEN), REGULAR_SOURCES[FIELD(cr2, CR2_EXTSEL)]);
    listen(chip, FIELD(cr2, CR2_JEXTEN), INJECTED_SOURCES[FIELD(cr2, CR2_JEXTSEL)]);
  }
}

/* -- registers -------------------------------------------------------------------------------------------- */

static uint32_t adc_peek(const Peripheral *peripheral, uint32_t offset) {
  const Adc *adc = (const Adc *)peripheral;
  return offset == CCR ? adc->common : REGISTER(adc, offset);
}

static bool adc_is_pure(const Peripheral *peripheral, uint32_t offset) {
  (void)peripheral;
  return offset != DR;
}

static uint32_t adc_read(Peripheral *peripheral, uint32_t offset, int64_t *until_ps) {
  Adc *adc = (Adc *)peripheral;
  if (offset != DR) {
    return adc_peek(peripheral, offset);
  }
  *until_ps = NOT_CACHEABLE_PS;
  if (adc->paused) {
    store_regular(adc);
    begin_regular(adc);
  }
  REGISTER(adc, SR) &= ~(uint32_t)SR_EOC;
  update_irq(adc);
  return REGISTER(adc, DR);
}

/* End the pause if firmware has cleared EOC, or if anything except a read of DR uses the results from now on. If CONT
 * is cleared, the present result is the last one. */
static void settings_changed(Adc *adc) {
  if (!adc->paused) {
    return;
  }
  if (!(cr2_of(adc) & CR2_CONT)) {
    store_regular(adc);
    adc->paused = false;
  } else if (is_result_used(adc) || !(REGISTER(adc, SR) & SR_EOC)) {
    begin_regular(adc);
  }
}

static void control_written(Adc *adc, uint32_t started) {
  if (!(cr2_of(adc) & CR2_DMA)) {
    adc->dma_ended = false;
  }
  triggers_changed(adc);
  if (!(cr2_of(adc) & CR2_ADON)) {
    stop(adc);
    return;
  }
  if (started & CR2_JSWSTART) {
    start_injected(adc);
  }
  if (started & CR2_SWSTART) {
    start_regular(adc);
  }
}

static uint32_t stored_of(uint32_t offset) {
  switch (offset) {
    case CR1: return CR1_STORED;
    case CR2: return CR2_STORED & ~(CR2_SWSTART | CR2_JSWSTART);
    case SMPR1: return SMPR1_STORED;
    case SMPR2: return SMPR2_STORED;
    case SQR1: return SQR1_STORED;
    case SQR2: return SQR2_STORED;
    case SQR3: return SQR3_STORED;
    case JSQR: return JSQR_STORED;
    default: return offset >= JDRx(1) ? 0 : HTR_STORED; /* JDRx and DR; JOFRx, HTR and LTR */
  }
}

static void adc_write(Peripheral *peripheral, uint32_t offset, uint32_t value, uint32_t mask) {
  Adc *adc = (Adc *)peripheral;
  if (offset == CCR) {
    write_bits(&adc->common, value, mask, CCR_STORED);
  } else if (offset == SR) {
    REGISTER(adc, SR) &= value | ~mask;
  } else {
    write_bits(&REGISTER(adc, offset), value, mask, stored_of(offset));
  }
  settings_changed(adc);
  if (offset == CR2) {
    control_written(adc, value & mask);
  }
  update_irq(adc);
}

static void adc_reset(Peripheral *peripheral) {
  Adc *adc = (Adc *)peripheral;
  memset(adc->registers, 0, sizeof adc->registers);
  REGISTER(adc, HTR) = HTR_RESET;
  adc->common = 0;
  adc->dma_ended = false;
  stop(adc);
  triggers_changed(adc);
  update_irq(adc);
}

static const PeripheralType ADC = {
  .read = adc_read, .peek = adc_peek, .write = adc_write, .reset = adc_reset, .is_pure = adc_is_pure
};

/* A reset does not change the voltages. */
void adc_create(Chip *chip) {
  Adc *adc = &chip->adc;
  peripheral_create(chip, &adc->peripheral, &ADC, ADC1_BASE, ADC1_SIZE, ADC_OFFSETS);
  adc->event = event_create(&adc->peripheral, on_event);
  adc_reset(&adc->peripheral);
}

AdcInputs *fcu_connect_adc(Chip *chip, const AdcCalls *calls) {
  chip->adc.calls = *calls;
  return &chip->adc.inputs;
}
