# SPDX-License-Identifier: Apache-2.0
# make run     the main job: a simulated UR5e moves, in real time; report and plot in out/
# make test    every test: Rust, Python, and the studio's page in a browser (Debian's chromium)
# make faults  the whole fault campaign, the fuzzers, 10^5 sequences of commands to an arm and the cell of 16 processors: hours; reports in out/
# make bench   ratios against hand-written loops and peers, taken in one run
# `make test` builds everything once, in the profile `checked`: the package that pytest imports, the Rust tests and the lints.
# The package in the source tree is of one profile at a time; `make setup` puts the release build back.
# make test-studio   the studio's page: types, lint, units;  make test-browser  the same page in a real browser against a running arm; screenshots in out/studio/
# make c-package   target/release/libopengpac_ps.so, for programming systems in C
.PHONY: run test test-browser faults bench c-package setup setup-checked test-rust test-loom test-sanitizer test-python test-studio lint clean
.DEFAULT_GOAL := run

PYTHON ?= python3
SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
# The package's extension as it is installed now: one of these two stamps stands, never both.
RELEASE := $(VENV)/release
CHECKED := $(VENV)/checked
RUST := $(shell find crates -name '*.rs' -o -name '*.c' -o -name '*.h' -o -name '*.py' -o -name Cargo.toml 2>/dev/null) Cargo.toml Cargo.lock
# The studio's page, which the wheel carries and the control interface serves.
PAGE := python/opengpac/studio_page/index.html
PAGE_SOURCES := $(shell find studio/src studio/public -type f 2>/dev/null) studio/index.html studio/vite.config.ts studio/tsconfig.json
# Where the plant's physics library lies: the Rust tests of its driver need it.
MUJOCO = $(shell $(BIN)/python -c 'import pathlib, importlib.util as u; print(pathlib.Path(u.find_spec("mujoco").origin).parent)' 2>/dev/null)

run: setup
	$(BIN)/python examples/coordinated_motion.py

setup: $(VENV)/ready $(PAGE) $(RELEASE)

setup-checked: $(VENV)/ready $(PAGE) $(CHECKED)

$(VENV)/ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check maturin numpy rich tomlkit mujoco matplotlib pytest hypothesis scipy ipython ipykernel nbclient mcap pyright ruff
	touch $@

$(RELEASE): $(RUST) pyproject.toml $(VENV)/ready
	@rm -f $(CHECKED)
	$(BIN)/maturin develop --release --quiet
	touch $@

$(CHECKED): $(RUST) pyproject.toml $(VENV)/ready
	@rm -f $(RELEASE)
	$(BIN)/maturin develop --profile checked --quiet
	touch $@

studio/node_modules/ready: studio/package-lock.json
	@node -e 'const [a, b] = process.versions.node.split("."); process.exit(a > 20 || (a == 20 && b >= 19) ? 0 : 1)' 2>/dev/null || \
		{ echo "the studio's page is built with Node 20.19 or newer, which is not here: install it from nodejs.org or your distribution"; false; }
	cd studio && npm install --no-save --no-audit --no-fund --loglevel=error
	touch $@

$(PAGE): $(PAGE_SOURCES) studio/node_modules/ready
	cd studio && npm run --silent build -- --logLevel error
	touch $@

test: lint test-rust test-loom test-sanitizer test-python test-studio test-browser

lint: setup-checked
	cargo fmt --all --check
	cargo clippy --workspace --features bindings/hosts --all-targets --profile checked --quiet -- -D warnings
	$(BIN)/ruff check python tests examples bench
	$(BIN)/pyright

test-rust: setup-checked
	OPENGPAC_MUJOCO=$(MUJOCO) cargo test --workspace --features bindings/hosts --profile checked --quiet --lib --bins --tests
	cargo test --workspace --features bindings/hosts --profile checked --quiet --doc

test-loom:
	RUSTFLAGS="--cfg loom" cargo test -p interconnect --release --test loom --target-dir target/loom

test-sanitizer:
	RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=realtime --cfg rtsan" cargo test -p kernel --test rtsan --target x86_64-unknown-linux-gnu --target-dir target/rtsan

# A process that dies takes its last words with it: what was said before is shown again, without the library's own lines.
test-python: setup-checked
	@mkdir -p out
	@set -o pipefail; $(BIN)/python -m pytest 2>&1 | tee out/pytest.log || \
		{ grep -v 'site-packages\|^  File "<frozen\|^Extension modules' out/pytest.log | tail -n 40 | cut -c 1-300; false; }

test-studio: studio/node_modules/ready
	cd studio && npm run --silent check

# The page in Debian's chromium against running systems; pictures in out/studio. Some minutes, more where graphics are computed.
test-browser: setup-checked studio/node_modules/ready
	cd studio && npm run --silent test:browser

faults: setup
	$(BIN)/python tests/faults/campaign.py
	$(BIN)/python tests/faults/fuzz.py
	$(BIN)/python tests/faults/no_jump.py
	$(BIN)/python tests/faults/shift.py
	$(BIN)/python tests/faults/sixteen.py
	cargo build --profile checked -p bindings --features hosts
	$(BIN)/python tests/faults/replays.py --also target/checked/lib_native.so
	OPENGPAC_PARTITIONS_S=1,3,10,30 cargo test -p hosts --release --test namespaces -- --nocapture
	cd studio && npm run --silent test:faults

bench: setup
	$(BIN)/python bench/run.py

c-package:
	cargo build --release -p c-package

clean:
	rm -rf target $(VENV) out python/opengpac/_native.abi3.so $(dir $(PAGE)) studio/node_modules
