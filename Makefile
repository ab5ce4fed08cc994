# The front door. Everything here can be called on a fresh Debian 12 machine, as root or with sudo:
#   make demo        bake a scanned bunny and the candle, draw them into out/
#   make test        build and pass the tests
# The build itself is CMake's (CMakeLists.txt).
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
DIAPHAN = build/diaphan
MAKEFLAGS += --no-print-directory

.PHONY: all setup configure build tool demo test test-long bench install pictures clean

all: build

setup:
	@scripts/setup.sh

configure: setup
	@cmake -S . -B build >build.log 2>&1 || { cat build.log; exit 1; }
	@rm -f build.log

build: configure
	@cmake --build build -j $(JOBS)

# without the tests
tool: configure
	@cmake --build build -j $(JOBS) --target diaphan-cli

demo: tool
	@scripts/demo.sh $(DIAPHAN) out

test: setup
	@JOBS=$(JOBS) scripts/test.sh

# minutes of fuzzing on top
test-long: test
	@tests/fuzz/run

bench: tool
	@$(DIAPHAN) bench bake

# needs no root where PREFIX or DESTDIR can be written
install:
	@test -x $(DIAPHAN) || $(MAKE) build
	@cmake --install build --prefix $(PREFIX)

# the picture of the README
pictures: tool
	@scripts/pictures.sh $(DIAPHAN) docs/images

clean:
	rm -rf build build-* out
