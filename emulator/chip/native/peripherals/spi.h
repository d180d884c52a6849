/* SPI1 to SPI3 (spi.c) and the devices at their pins (spi_line.c). */
#ifndef FCU_SPI_H
#define FCU_SPI_H

#include "peripherals/peripheral.h"

#define SPIS 3
#define SPI_SENSORS 4
#define SPI_RECEIVED 256 /* the size of an answer in C; Python handles longer ones */
#define SPI_RECENT 8     /* messages, and unheard bytes, kept for diagnosis */

#define SPI_READ 0x80u     /* in a message's first byte: the sensor answers */
#define SPI_UNDRIVEN 0xFFu /* the value read from a line without a driver */
#define SPI_NOTHING (-1)   /* in place of a byte: none */

/* The bytes between two edges of a chip select. */
typedef struct {
  int64_t start_ps, end_ps;
  int32_t sensor;
  int32_t command; /* the first byte from the host; or SPI_NOTHING */
  int32_t count;   /* bytes received */
  uint8_t received[SPI_RECEIVED];
} SpiMessage;

typedef struct {
  int64_t at_ps;
  int32_t byte; /* sent; SPI_NOTHING: one was read */
} SpiUnaddressed;

/* Callbacks into Python for messages that C cannot answer. Sensors are numbered in the order of connection. */
typedef struct {
  /* From the next byte on, the host's clock and mode, and the wires that it reads, are these. */
  void (*configure)(int64_t now_ps, int32_t speed_hz, int32_t mode, int32_t wires);
  /* The rest of this message goes to Python, together with the bytes so far. Returns 1 if the sensor has power. */
  int32_t (*open)(int64_t now_ps, const SpiMessage *message);
  void (*send)(int64_t now_ps, int32_t sensor, int32_t byte);
  int32_t (*receive)(int64_t now_ps, int32_t sensor, int32_t wires);
  /* A message in Python has ended. */
  void (*close)(int64_t now_ps, int32_t sensor);
  /* While the trace is detailed: a message that C has answered has ended, and can be taken. */
  void (*ended)(int64_t now_ps);
} SpiCalls;

/* A sensor at a chip select. */
typedef struct {
  int32_t port, pin;
  int32_t target;     /* index of its read cache (read_cache.h); negative: none */
  uint8_t is_powered; /* the sensor has power and answers */
  uint8_t is_selected, is_live, is_reading;
  SpiMessage message;
} SpiSensor;

/* The devices at the pins of an SPI. */
typedef struct {
  SpiCalls calls;
  uint8_t has_devices; /* sensors are connected, or can be */
  uint8_t wires;    /* the host reads on three or four wires */
  int32_t mode, speed_hz;
  int32_t sensor_count;
  SpiSensor sensors[SPI_SENSORS];
  uint8_t selected[SPI_SENSORS]; /* in the order of selection */
  int32_t selected_count;
  SpiMessage recent[SPI_RECENT]; /* those that C has answered, the latest at recent_count - 1, modulo SPI_RECENT */
  uint32_t recent_count, recent_taken;
  SpiUnaddressed unaddressed[SPI_RECENT];
  uint32_t unaddressed_count, unaddressed_taken;
  int32_t absent_port, absent_pin;     /* chip select of an absent module; SPI_NOTHING: none */
  void (*on_absent_access)(int64_t now_ps); /* firmware sends to the module; NULL after the first report */
} SpiLine;

typedef struct {
  Peripheral peripheral;
  uint32_t number; /* 0: SPI1 */
  uint32_t cr1, cr2, sr, crcpr, i2scfgr, i2spr;
  uint32_t to_send, received; /* DR's two buffers */
  int32_t shift;              /* the current frame; SPI_NOTHING in a receive direction */
  uint8_t is_busy;
  uint8_t data_read; /* DR was read since OVR: a read of SR clears it */
  uint8_t modf_seen;
  uint8_t in_dma; /* DMA requests are being made */
  uint8_t wants_events; /* an interrupt or DMA is enabled: the end of a frame is an event */
  uint8_t is_connected;
  int32_t configured_cr1; /* bits of CR1 for which the line was last configured */
  int64_t byte_ps;
  int32_t event; /* the end of the current frame */
  SpiLine line;
} Spi;

void spi_create(Chip *chip);

/* -- spi_line.c ------------------------------------------------------------------------------------------ */

void spi_line_create(SpiLine *line);
void spi_line_configure(Spi *spi, int32_t speed_hz, int32_t mode);
/* Exchange a byte each way; with three wires: one out, or one in. Called at the end of the byte. */
uint8_t spi_line_exchange(Spi *spi, uint8_t out);
void spi_line_send(Spi *spi, uint8_t out);
uint8_t spi_line_receive(Spi *spi);

#endif
