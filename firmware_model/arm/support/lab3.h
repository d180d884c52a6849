/* All headers that a LAB3 program needs. */
#ifndef LAB3_H
#define LAB3_H

#include "board.h"
#include "debug.h"
#include "lis2mdl.h"
#include "lps22hb.h"
#include "lsm6dsl.h"
#include "sensor_bus.h"
#include "sensor_data.h"
#include "sensor_setup.h"
#include "steval_fcu001_v1.h"

#endif
