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
# asked once, when first needed: `make deps all` may have to install pkg-config first
PKG_C    = $(eval PKG_C := $$(shell pkg-config --cflags $(LIBS) 2>/dev/null))$(PKG_C)
PKG_L    = $(eval PKG_L := $$(shell pkg-config --libs $(filter-out cfitsio,$(LIBS)) 2>/dev/null))$(PKG_L)
# cfitsio brings 35 libraries: it is loaded by name, when a tile-compressed image is read
SONAME   = $(eval SONAME := $$(or $$(shell readelf -d "$$$$(pkg-config --variable=libdir cfitsio 2>/dev/null)/libcfitsio.so" 2>/dev/null | sed -n 's/.*(SONAME).*\[\(.*\)\].*/\1/p'),libcfitsio.so))$(SONAME)

# Same bits from every compiler and processor: no contraction, no fast-math.
ALL_C    = -std=c11 -D_GNU_SOURCE -DPIXSHEAR_VERSION='"$(VERSION)"' -DCFITSIO_LIBRARY='"$(SONAME)"' -Icommon $(PKG_C) \
           $(CFLAGS) -ffp-contract=off -fno-math-errno -pthread $(WARN) $(WERROR) $(SAN)
ALL_L    = $(LDFLAGS) $(SAN) $(PKG_L) -lm -ldl -pthread

PROGRAMS := $(patsubst cmd/%.c,%,$(wildcard cmd/*.c))
COMMON   := $(patsubst common/%.c,$(BUILD)/common/%.o,$(wildcard common/*.c))
UNIT     := $(patsubst tests/unit/%.c,$(BUILD)/unit/%,$(wildcard tests/unit/*.c))
TOOLS    := $(patsubst tests/tool/%.c,$(BUILD)/tool/%,$(wildcard tests/tool/*.c))
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
	@pkg-config $(LIBS) 2>/dev/null || { echo "libraries are missing: run 'make deps' first (cfitsio wcslib gsl fftw3 zlib by pkg-config)" >&2; exit 1; }
	@echo '$(subst ','\'',$(CC) $(ALL_C) $(ALL_L))' | cmp -s - $@ || echo '$(subst ','\'',$(CC) $(ALL_C) $(ALL_L))' > $@
FORCE:
.SECONDARY:
ifneq ($(filter deps,$(MAKECMDGOALS)),)
$(BUILD)/flags layers: | deps
endif

-include $(wildcard $(BUILD)/common/*.d $(BUILD)/cmd/*.d $(BUILD)/tests/unit/*.d)

layers:    # check that common/ has an order and that only unpack knows cfitsio
	@tests/layers

$(BUILD)/tool/%: $(BUILD)/tests/tool/%.o $(BUILD)/libcommon.a
	@mkdir -p $(@D)
	$(CC) -o $@ $< $(BUILD)/libcommon.a $(ALL_L)

$(BUILD)/fault.so: tests/fault.c $(BUILD)/flags
	$(CC) -D_GNU_SOURCE -O1 -fPIC -shared -o $@ $< -ldl

check: all $(UNIT) $(TOOLS) $(BUILD)/fault.so    # run every test
	BIN=$(BIN) BUILD=$(BUILD) tests/run $(UNIT) $(sort $(wildcard tests/cmd/*.sh tests/peer/*.sh))

check-large: all $(UNIT) $(TOOLS)    # tests that need time or memory
	LIMIT=3600 BIN=$(BIN) BUILD=$(BUILD) tests/run $(sort $(wildcard tests/large/*.sh))

sanitize:    # the tests again under AddressSanitizer and UndefinedBehaviorSanitizer
	LIMIT=3600 $(MAKE) check BUILD=build/sanitize BIN=build/sanitize/bin CFLAGS='-O1 -g' \
	    SAN='-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer'

tsan:    # the tests again under ThreadSanitizer
	LIMIT=3600 $(MAKE) check BUILD=build/tsan BIN=build/tsan/bin CFLAGS='-O2 -g' SAN='-fsanitize=thread'

fuzz:    # RUNS (100000) random inputs for each reader, guided by coverage; needs clang
	tests/fuzz/run $(RUNS)

coverage:    # lines that the tests reach, one figure a file
	$(MAKE) check BUILD=build/coverage BIN=build/coverage/bin CFLAGS='-O0 -g --coverage' LDFLAGS=--coverage
	@tests/coverage build/coverage

lint:    # man pages, shell scripts, compiler warnings as errors with gcc and clang
	tests/lint

bench: all    # accuracy and time of every program, against its peers where installed
	tests/bench/run

accuracy: all $(TOOLS)    # what accuracy costs in time: measured curves, table and figure
	$(MAKE) -C examples/accuracy

# all cores for building, too, unless make was told how many
JOBS      = $(if $(filter -j%,$(MAKEFLAGS)),,-j$(shell nproc 2>/dev/null || echo 1))

quick: $(filter deps,$(MAKECMDGOALS))    # the small experiment: a minute, table and figures in examples/pixelscale/quick
	$(MAKE) $(JOBS) all
	$(MAKE) -C examples/pixelscale quick $(if $(GALAXIES),GALAXIES=$(abspath $(GALAXIES)))

paper: $(filter deps,$(MAKECMDGOALS))    # the whole experiment of High et al. (2007): some minutes
	$(MAKE) $(JOBS) all
	$(MAKE) -C examples/pixelscale paper $(if $(GALAXIES),GALAXIES=$(abspath $(GALAXIES)))

calibration: all    # how good the shears are: slopes and biases with errors on 24 fields; a quarter of an hour
	$(MAKE) -C examples/calibration

dithers: all    # what imperfect dithers cost: noise, galaxies, slopes against drop size; four minutes
	$(MAKE) -C examples/dithers

threshold: all    # objects against pixel scale by two thresholds; ten seconds
	$(MAKE) -C examples/threshold

deps:    # install the compiler, the libraries and the plotter (Debian, Ubuntu)
	@tests/deps

deps-slurm:    # install a Slurm for the test of runs on clusters (Debian, Ubuntu)
	@tests/deps slurm

COMPLETION = $(DESTDIR)$(PREFIX)/share/bash-completion/completions

install: all    # programs, man pages, completion under $(DESTDIR)$(PREFIX)
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/man/man1 $(DESTDIR)$(PREFIX)/share/man/man7 $(COMPLETION)
	install $(PROGRAMS:%=$(BIN)/%) $(DESTDIR)$(PREFIX)/bin
	install -m 644 $(filter %.1,$(MAN)) $(DESTDIR)$(PREFIX)/share/man/man1
	install -m 644 $(filter %.7,$(MAN)) $(DESTDIR)$(PREFIX)/share/man/man7
	for p in $(PROGRAMS); do examples/completion $(BIN)/$$p > $(COMPLETION)/$$p; done

uninstall:    # remove what install put there
	rm -f $(PROGRAMS:%=$(DESTDIR)$(PREFIX)/bin/%) $(PROGRAMS:%=$(COMPLETION)/%)
	rm -f $(patsubst man/%.1,$(DESTDIR)$(PREFIX)/share/man/man1/%.1,$(filter %.1,$(MAN)))
	rm -f $(patsubst man/%.7,$(DESTDIR)$(PREFIX)/share/man/man7/%.7,$(filter %.7,$(MAN)))

clean:    # remove everything that was built
	rm -rf build bin
	$(MAKE) -s -C examples/pixelscale clean
	$(MAKE) -s -C examples/calibration clean
	$(MAKE) -s -C examples/dithers clean
	$(MAKE) -s -C examples/threshold clean
	$(MAKE) -s -C examples/accuracy clean

help:    # this list
	@sed -n 's/^\([a-z-]*\):[^=#]*# */\1\t/p' Makefile | awk -F'\t' '{ printf "  %-12s %s\n", $$1, $$2 }'

.PHONY: all layers check check-large sanitize tsan fuzz coverage lint bench accuracy quick paper calibration dithers threshold deps deps-slurm install uninstall clean help FORCE
