/* Start-up of the sensors, as ST's main.c does it. */
#ifndef SENSOR_SETUP_H
#define SENSOR_SETUP_H

/* Initialise the sensors one after the other; never returns if one is missing or is another part. */
void initializeAllSensors(void);

/* Start each sensor and say so. */
void enableAllSensors(void);

/* Set the output rates, ranges and filters of the lab. */
void setUpForFlight(void);

#endif
