/* Start-up of the sensors, as ST's main.c does it. */
#ifndef SENSOR_SETUP_H
#define SENSOR_SETUP_H

/* Initialises the sensors one after the other. It never returns if a sensor is missing or has
 * another identity. */
void initializeAllSensors(void);

/* Start each sensor and print a line about it. */
void enableAllSensors(void);

/* Set the output rates, ranges and filters of the lab. */
void setUpForFlight(void);

#endif
