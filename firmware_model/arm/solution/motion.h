/* Exercises 2, 3 and 5: altitude, pitch, roll, yaw, hard-iron calibration. */
#ifndef MOTION_H
#define MOTION_H

#include "axes.h"

/* Defined in main.c. X right, Y forward, Z up. */
extern AxesRaw_TypeDef acc; /* mg */
extern AxesRaw_TypeDef mag; /* mgauss; calibrated in place by MagCalibration */
extern float press_zero_level; /* hPa at the floor of the room, 0 m */

/* Degrees. Yaw (azimuth) is 0 when X points to magnetic north; it grows counter-clockwise, seen from above. */
extern float pitch, roll, azimuth;

/* Minimum and maximum of each axis so far, in mgauss. */
extern AxesRaw_TypeDef mag_min, mag_max;

/* Widens the extremes by this sample and subtracts their centre. Call it once for every sample;
 * the first sample gives 0. */
void MagCalibration(void);

/* Computes pitch, roll and azimuth from acc and mag. */
void eCompass(void);

/* Height in m above the floor; press in hPa, temperature in degC. */
float getAltitude(float press, float temperature);

#endif
