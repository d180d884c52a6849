# How a LAB3 program is built. The including Makefile sets:
#   NAME     path of the program without .elf     SOURCES  its own .c files, beside support/
#   SUPPORT  path of this folder                  BUILD    where objects go
#   BUS      I2C2 or SPI2                         OPT      optimisation
# and may set PREFIX (path and name of the compiler up to "gcc") and EXTRA_CFLAGS.

PREFIX ?= arm-none-eabi-
CC := $(PREFIX)gcc

ifeq ($(filter $(BUS),I2C2 SPI2),)
$(error BUS is "$(BUS)"; it must be I2C2 or SPI2)
endif
bus := $(if $(filter SPI2,$(BUS)),spi2,i2c2)

SUPPORT_SOURCES := $(filter-out %/sensor_bus_i2c2.c %/sensor_bus_spi2.c,$(sort $(wildcard $(SUPPORT)/*.c))) \
                   $(SUPPORT)/sensor_bus_$(bus).c
OBJECTS := $(addprefix $(BUILD)/,$(SOURCES:.c=.o) $(addprefix support/,$(notdir $(SUPPORT_SOURCES:.c=.o))))

# The compiler reads its options from files. `fcu build`, which does not use make, gives the compiler the same files.
# compile.options makes int32_t an int, as on a PC, instead of newlib's long int of the same size. The slides print
# int32_t with %d, so -Wformat then warns about mistakes only.
# link.options has -u _printf_float, because otherwise the small C library prints nothing for %f.
CPU := @$(SUPPORT)/cpu.options
CFLAGS := $(CPU) $(OPT) @$(SUPPORT)/compile.options -I$(SUPPORT) $(if $(filter spi2,$(bus)),-DSENSORS_ON_SPI2) \
          $(EXTRA_CFLAGS)
LDFLAGS := $(CPU) @$(SUPPORT)/link.options -T $(SUPPORT)/STM32F401CC.ld

$(NAME).elf: $(OBJECTS) $(SUPPORT)/STM32F401CC.ld $(SUPPORT)/link.options
	@echo "  LINK    $@"
	@$(CC) $(LDFLAGS) $(OBJECTS) -lm -o $@

$(BUILD)/support/%.o: $(SUPPORT)/%.c
	@mkdir -p $(@D)
	@echo "  CC      $<"
	@$(CC) $(CFLAGS) -MMD -c $< -o $@

$(BUILD)/%.o: %.c
	@mkdir -p $(@D)
	@echo "  CC      $<"
	@$(CC) $(CFLAGS) -MMD -c $< -o $@

$(OBJECTS): $(MAKEFILE_LIST) $(SUPPORT)/cpu.options $(SUPPORT)/compile.options

-include $(OBJECTS:.o=.d)
