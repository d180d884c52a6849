/* Start-up of the sensors. */
#include "sensor_setup.h"

#include "debug.h"
#include "lis2mdl.h"
#include "lps22hb.h"
#include "lsm6dsl.h"

void initializeAllSensors(void)
{
  if (LSM6DSL_X_Init() != COMPONENT_OK) {
    while (1) {
    }
  }
  if (LSM6DSL_G_Init() != COMPONENT_OK) {
    while (1) {
    }
  }
  if (LIS2MDL_Init() != COMPONENT_OK) {
    while (1) {
    }
  }
  if (LPS22HB_Init() != COMPONENT_OK) {
    while (1) {
    }
  }
}

void enableAllSensors(void)
{
  LSM6DSL_X_Enable();
  PRINTF("LSM6DSL MEMS Accelerometer initialized and enabled\n");
  LSM6DSL_G_Enable();
  PRINTF("LSM6DSL MEMS Gyroscope initialized and enabled\n");
  LIS2MDL_Enable();
  PRINTF("LIS2MDL Magnetometer initialized and enabled\n");
  LPS22HB_Enable();
  PRINTF("LPS22HB Pressure sensor initialized and enabled\n");
  LPS22HB_Enable();
  PRINTF("LPS22HB Temperature sensor initialized and enabled\n");
}

void setUpForFlight(void)
{
  LSM6DSL_FlightSetup();
  LIS2MDL_FlightSetup();
}
