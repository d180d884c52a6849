/* PWM outputs of the timers (RM0368 section 12.3.9).
 *
 * NOT MODELLED, silent: break input, dead time; outputs as levels of pins.
 */
#include "fcu.h"

#include "peripherals/tim_counter.h"

#define OCM(settings) FIELD(settings, CCMR1_OC1M)
enum { FORCED_LOW = 4, FORCED_HIGH = 5, PWM1 = 6, PWM2 = 7 };

/* PWM mode 1 is active while CNT < CCR; when the timer counts down, while CNT <= CCR (12.3.9). */
static double duty_below(const Tim *tim, uint32_t compare) {
  double cycle = tim->mode == TIM_CENTRE ? (double)tim->arr : (double)tim->arr + 1;
  double share = (tim->mode == TIM_DOWN ? compare + 1.0 : compare) / cycle;
  return share < 1 ? share : 1;
}

/* Return a negative number if the channel has neither PWM nor a constant level. */
static double duty_of(const Tim *tim, const TimChannel *channel) {
  uint32_t mode = OCM(channel->settings);
  double active;
  if (is_input(channel) || !(channel->enable & CCER_CC1E)) {
    return -1;
  }
  if (mode == FORCED_LOW || mode == FORCED_HIGH) {
    active = mode == FORCED_HIGH;
  } else if ((mode == PWM1 || mode == PWM2) && tim->arr) {
    active = duty_below(tim, channel->compare);
    active = mode == PWM2 ? 1 - active : active;
  } else {
    return -1;
  }
  return channel->enable & CCER_CC1P ? 1 - active : active;
}

int32_t fcu_timer_pwm(const Chip *chip, int32_t index, int32_t channel, double *frequency_hz, double *duty) {
  Tim now = tim_at_present((const Tim *)chip->peripherals[index]);
  if (channel < 1 || channel > now.variant->channels) {
    return -1;
  }
  bool off = now.variant->advanced && !(REGISTER(&now, BDTR) & BDTR_MOE);
  int halves = now.mode == TIM_CENTRE ? 2 : 1;
  *duty = duty_of(&now, &now.channels[channel - 1]);
  *frequency_hz = is_blocked(&now) ? 0 : (double)now.hz / (double)(now.prescale * now.overflow_period * halves);
  return *duty >= 0 && !off && now.running && !is_blocked(&now);
}
