# pixshear - small FITS filters that tell what pixels do to weak-lensing shear.
# `make help` lists the targets.  Needs a C11 compiler, make and pkg-config.

VERSION  = 0.1.0
PREFIX   = /usr/local
DESTDIR  =
CC       = cc
CFLAGS   = -O3
WARN     = -Wall -Wextra -Wshadow -Wconversion -Wstrict-prototypes -Wmissing-prototypes
WERROR   =
SAN      =
BUILD    = build
BIN      = bin

SHELL       = bash
.SHELLFLAGS = -o pipefail -ec
.DELETE_ON_ERROR:
.DEFAULT_GOAL := all

LIBS     = cfitsio wcslib gsl fftw3 zlib
PKG_C   := $(shell pkg-config --cflags $(LIBS) 2>/dev/null)
PKG_L   := $(shell pkg-config --libs $(LIBS) 2>/dev/null)

# Same bits from every compiler and processor: no contraction, no fast-math.
ALL_C    = -std=c11 -D_GNU_SOURCE -DPIXSHEAR_VERSION='"$(VERSION)"' -Icommon $(PKG_C) \
           $(CFLAGS) -ffp-contract=off -pthread $(WARN) $(WERROR) $(SAN)
ALL_L    = $(LDFLAGS) $(SAN) $(PKG_L) -lm -pthread

PROGRAMS := $(patsubst cmd/%.c,%,$(wildcard cmd/*.c))
COMMON   := $(patsubst common/%.c,$(BUILD)/common/%.o,$(wildcard common/*.c))
UNIT     := $(patsubst tests/unit/%.c,$(BUILD)/unit/%,$(wildcard tests/unit/*.c))
MAN      := $(wildcard man/*.[17])

all: $(PROGRAMS:%=$(BIN)/%)    # build every program

$(BIN)/%: $(BUILD)/cmd/%.o $(BUILD)/libcommon.a
	@mkdir -p $(@D)
	$(CC) -o $@ $< $(BUILD)/libcommon.a $(ALL_L)

$(BUILD)/unit/%: $(BUILD)/tests/unit/%.o $(BUILD)/libcommon.a
	@mkdir -p $(@D)
	$(CC) -o $@ $< $(BUILD)/libcommon.a $(ALL_L)

$(BUILD)/libcommon.a: $(COMMON)
	@rm -f $@
	ar rcs $@ $^

$(BUILD)/%.o: %.c $(BUILD)/flags | layers
	@mkdir -p $(@D)
	$(CC) $(ALL_C) -MMD -MP -c -o $@ $<

# Rebuild everything when the flags change.
$(BUILD)/flags: FORCE
	@mkdir -p $(@D)
	@[ -n "$(PKG_L)" ] || { echo "libraries are missing: run 'make deps' first (cfitsio wcslib gsl fftw3 zlib by pkg-config)" >&2; exit 1; }
	@echo '$(subst ','\'',$(CC) $(ALL_C) $(ALL_L))' | cmp -s - $@ || echo '$(subst ','\'',$(CC) $(ALL_C) $(ALL_L))' > $@
FORCE:
.SECONDARY:

-include $(wildcard $(BUILD)/common/*.d $(BUILD)/cmd/*.d $(BUILD)/tests/unit/*.d)

layers:    # check that common/ has an order and that only imageio knows cfitsio
	@tests/layers
