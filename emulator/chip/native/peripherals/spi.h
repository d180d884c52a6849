/* SPI1 to SPI3 (spi.c), and the devices at their pins (spi_line.c). */
#ifndef FCU_SPI_H
#define FCU_SPI_H

#include "peripherals/peripheral.h"

#define SPIS 3
#define SPI_SENSORS 4
#define SPI_RECEIVED 256 /* C handles answers up to this length, Python handles longer ones */
#define SPI_RECENT 8

#define SPI_READ 0x80u     /* bit of a message's first byte; 1 if the host reads */
#define SPI_UNDRIVEN 0xFFu /* value read if no device drives the line */
#define SPI_NOTHING (-1)

/* A message: the bytes between two edges of a chip select. */
typedef struct {
  int64_t start_ps, end_ps;
  int32_t sensor;
  int32_t command; /* first byte sent by the host */
  int32_t count;
  uint8_t received[SPI_RECEIVED];
} SpiMessage;

typedef struct {
  int64_t at_ps;
  int32_t byte; /* byte sent by the host; SPI_NOTHING: the host only received */
} SpiUnaddressed;

/* Callbacks into Python. The argument sensor is the number of the sensor. */
typedef struct {
  /* Apply settings to the following bytes. */
  void (*configure)(int64_t now_ps, int32_t speed_hz, int32_t mode, int32_t wires);
  /* Python takes over the message with the bytes so far. Return 1 if the sensor has power. */
  int32_t (*open)(int64_t now_ps, const SpiMessage *message);
  void (*send)(int64_t now_ps, int32_t sensor, int32_t byte);
  int32_t (*receive)(int64_t now_ps, int32_t sensor, int32_t wires);
  void (*close)(int64_t now_ps, int32_t sensor);
  /* A message has been recorded; called only while chip->detailed is set. */
  void (*ended)(int64_t now_ps);
} SpiCalls;

typedef struct {
  int32_t port, pin;
  int32_t target;     /* index in sensor_registers.h; negative: Python handles reads */
  uint8_t is_powered; /* the sensor has power and responds */
  uint8_t is_selected, is_live, is_reading;
  SpiMessage message;
} SpiSensor;

typedef struct {
  SpiCalls calls;
  uint8_t has_devices; /* devices are or will be connected */
  uint8_t wires;       /* wires for reading: 3 or 4 */
  int32_t mode, speed_hz;
  int32_t sensor_count;
  SpiSensor sensors[SPI_SENSORS];
  uint8_t selected[SPI_SENSORS];
  int32_t selected_count;
  uint8_t conflict_noted; /* a note was made since the latest selection */
  SpiMessage recent[SPI_RECENT];
  uint32_t recent_count, recent_taken;
  SpiUnaddressed unaddressed[SPI_RECENT];
  uint32_t unaddressed_count, unaddressed_taken;
  int32_t absent_port, absent_pin;          /* chip select; SPI_NOTHING: none */
  void (*on_absent_access)(int64_t now_ps); /* NULL after the first access */
} SpiLine;

typedef struct {
  Peripheral peripheral;
  uint32_t number; /* 0: SPI1 */
  uint32_t cr1, cr2, sr, crcpr, i2scfgr, i2spr;
  uint32_t to_send, received;
  int32_t shift; /* SPI_NOTHING: receive only */
  uint8_t is_busy;
  uint8_t data_read; /* DR was read after OVR was set: the next read of SR clears OVR */
  uint8_t modf_seen;
  uint8_t received_seen; /* SR was read with RXNE = 1 since the latest frame */
  uint8_t in_dma;
  uint8_t wants_events;
  uint8_t is_connected;
  int32_t configured_cr1; /* CR1 of the line's present settings */
  int64_t byte_ps;
  int64_t received_ps; /* end of the latest frame */
  int64_t active_ps;   /* time of the latest write or end of a frame */
  int32_t event;
  SpiLine line;
} Spi;

void spi_create(Chip *chip);

void spi_line_create(SpiLine *line);
void spi_line_configure(Spi *spi, int32_t speed_hz, int32_t mode);
/* Exchange a byte with the selected sensors when its last bit has been clocked. With three wires, use
 * spi_line_send() or spi_line_receive() instead. */
uint8_t spi_line_exchange(Spi *spi, uint8_t out);
void spi_line_send(Spi *spi, uint8_t out);
uint8_t spi_line_receive(Spi *spi);

#endif
