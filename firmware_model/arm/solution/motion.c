/* Altitude, eCompass and hard-iron calibration, as on the slides.
 *
 * Each right-hand side is computed in double, like the functions of math.h, and stored in a float
 * for the next line. A float is precise enough for six printed decimals of an angle.
 */
#include "motion.h"

#include <math.h>

#define MU 1.0 /* weight of Gx in the roll, 0.01..1: with a small MU the roll is exact, with a large
                  MU it is steady near a pitch of 90 deg */
#define DEGREES (180 / M_PI)
#define KELVIN 273.15
#define LAPSE_RATE 0.0065 /* K/m, in the standard atmosphere */
#define EXPONENT (1 / 5.257)

float pitch, roll, azimuth;
AxesRaw_TypeDef mag_min = {10000, 10000, 10000}, mag_max = {-10000, -10000, -10000};

void MagCalibration(void)
{
  /* find min */
  if (mag.AXIS_X < mag_min.AXIS_X) mag_min.AXIS_X = mag.AXIS_X;
  if (mag.AXIS_Y < mag_min.AXIS_Y) mag_min.AXIS_Y = mag.AXIS_Y;
  if (mag.AXIS_Z < mag_min.AXIS_Z) mag_min.AXIS_Z = mag.AXIS_Z;
  /* find max */
  if (mag.AXIS_X > mag_max.AXIS_X) mag_max.AXIS_X = mag.AXIS_X;
  if (mag.AXIS_Y > mag_max.AXIS_Y) mag_max.AXIS_Y = mag.AXIS_Y;
  if (mag.AXIS_Z > mag_max.AXIS_Z) mag_max.AXIS_Z = mag.AXIS_Z;
  /* hard-iron calibration */
  mag.AXIS_X -= (mag_max.AXIS_X + mag_min.AXIS_X) / 2;
  mag.AXIS_Y -= (mag_max.AXIS_Y + mag_min.AXIS_Y) / 2;
  mag.AXIS_Z -= (mag_max.AXIS_Z + mag_min.AXIS_Z) / 2;
}

void eCompass(void)
{
  /* The integer is negated, not the double: a flat board must give 0.0, but -(0.0) is -0.0. */
  double minus_gx = -acc.AXIS_X, gy = acc.AXIS_Y, gz = acc.AXIS_Z;
  double bx = mag.AXIS_X, by = mag.AXIS_Y, bz = mag.AXIS_Z;
  float by2, bz2, bx3;

  pitch = atan2(minus_gx, sqrt(gy * gy + gz * gz));
  roll = atan2(gy, sqrt(MU * (minus_gx * minus_gx) + gz * gz));
  double sin_roll = sin(roll), cos_roll = cos(roll);
  by2 = bz * sin_roll - by * cos_roll;
  bz2 = by * sin_roll + bz * cos_roll;
  bx3 = bx * cos(pitch) + bz2 * sin(pitch);
  azimuth = atan2(by2, bx3);

  pitch = pitch * DEGREES;
  roll = roll * DEGREES;
  azimuth = azimuth * DEGREES;
}

float getAltitude(float press, float temperature)
{
  double ratio = (double)press_zero_level / press;
  return (pow(ratio, EXPONENT) - 1) * (temperature + KELVIN) / LAPSE_RATE;
}
