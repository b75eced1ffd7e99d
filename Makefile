# Everything there is to type. `make demo` and `make test` do all the set-up they need.

CARGO ?= cargo
PY := .venv/bin/python
WHEELS := target/wheels
COMPARE := .venv-compare/bin/python

# One interpreter for cargo and maturin, so that the binding is not built twice.
test lint wheel compare docs arrays: export PYO3_PYTHON := $(CURDIR)/$(PY)
test lint wheel compare docs arrays: export VIRTUAL_ENV := $(CURDIR)/.venv

# What is needed to compile parts of a crate anew makes compiling all of it half as long again.
test: export CARGO_INCREMENTAL ?= 0

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo test reproduce lint wheel dist wheel-test venv ffmpeg chromium bench instructions compare matrix scaling \
	trust trust-long boundary deny sbom semver agreement long kills calls arrays fuzz miri miri-core asan tsan docs clean

help: ## this list
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/  make \1\t\2/p' Makefile | expand -t 22

demo: ## build the program and let it find targets in a scene it makes itself; results in demo-out/
	@$(CARGO) build --release --package apgstmd-cli
	@$(CARGO) run --release --quiet --package apgstmd-cli -- demo --out demo-out --force

reproduce: ## the paper's experiments, all of them: figures, numbers and a page in reproduce-out/
	@$(CARGO) run --release --quiet --package apgstmd-cli -- reproduce all --out reproduce-out --force

test: ffmpeg chromium lint ## format, lints, Rust tests, wheel, Python tests, type stubs, the paper's experiments in brief
	@echo "== cargo test"
	@$(CARGO) test --workspace --quiet
	@$(MAKE) --no-print-directory wheel
	@echo "== pytest, against the installed wheel"
	@$(PY) -m pytest --quiet --numprocesses 2 --dist loadfile
	@echo "== mypy and stubtest"
	@$(PY) -m mypy
	@$(PY) -m mypy.stubtest apgstmd._core --mypy-config-file pyproject.toml
	@echo "== the paper's experiments, quick; figures in target/reproduce"
	@.venv/bin/apgstmd reproduce --quick --quiet --force --out target/reproduce

lint: venv ## rustfmt and clippy, warnings are errors
	@echo "== cargo fmt, clippy"
	@$(CARGO) fmt --all --check
	@$(CARGO) clippy --workspace --all-targets --quiet -- -D warnings

wheel: venv ## build the Python wheel into target/wheels and install it into .venv
	@echo "== wheel"
	@rm -f $(WHEELS)/*.whl
	@$(PY) -m maturin build --release --quiet --interpreter $(PY) --out $(WHEELS)
	@$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall $(WHEELS)/*.whl
	@ls $(WHEELS)/*.whl

dist: ## wheel for any Linux since 2018 and source archive, checked, in dist/
	@tools/venv.sh .venv-dist tools/requirements-dist.txt
	@tools/dist.sh

wheel-test: dist ## dist, installed where there is neither this folder nor Rust, and tried
	@tools/wheel-test.sh

venv:
	@tools/venv.sh

ffmpeg:
	@tools/ffmpeg.sh

chromium:
	@tools/chromium.sh

bench: ## criterion benchmarks of each stage and of whole frames
	@$(CARGO) bench --package apgstmd-benches --bench model

instructions: ## instructions of one frame under valgrind, beside those of the last run: numbers that do not jitter
	@command -v valgrind > /dev/null || (apt-get update -qq && apt-get install -qq -y valgrind)
	@$(CARGO) install --quiet --root target/tools --version 0.20.0 gungraun-runner
	@GUNGRAUN_RUNNER=target/tools/bin/gungraun-runner $(CARGO) bench --quiet --package apgstmd-benches --bench instructions

compare: wheel ## the same clip through apgstmd, NumPy + OpenCV, and OpenCV's background subtraction: a table
	@tools/venv.sh .venv-compare benches/compare/requirements.txt
	@$(COMPARE) -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall $(WHEELS)/*.whl
	@echo "== the NumPy model agrees with apgstmd"
	@$(COMPARE) -m pytest --quiet --config-file=/dev/null --rootdir=benches/compare -p no:cacheprovider benches/compare
	@echo "== timing"
	@$(COMPARE) benches/compare/compare.py $(COMPARE_FLAGS)

matrix: ## what the bank finds of every speed, size, contrast, ground and camera; CSV and tables in target/matrix/
	@$(CARGO) run --release --quiet --package apgstmd-benches --bin matrix -- target/matrix

scaling: ## how time grows with threads, pixels, active tiles, instruction sets; CSV and SVG in target/scaling/
	@$(CARGO) run --release --quiet --package apgstmd-cli -- bench --scaling target/scaling $(SCALING_FLAGS)

# The sanitizers and Miri come with the nightly compiler: rustup toolchain install nightly --component miri,rust-src
HOST = $(shell rustc -vV | sed -n 's/^host: //p')
FUZZ_TIME ?= 1200

trust: boundary deny sbom agreement ## what the project promises of hostile input, quickly: boundaries, licences, Miri, a little fuzzing
	@$(MAKE) --no-print-directory miri
	@$(MAKE) --no-print-directory fuzz FUZZ_TIME=20

trust-long: trust fuzz asan tsan miri-core kills calls arrays long ## the rest: fuzzing for FUZZ_TIME seconds a target (1200), sanitizers, the core under Miri, long runs

boundary:
	@python3 tools/unsafe.py --check
	@echo "== boundaries, hostile files, extremes, dependencies"
	@BOUNDARY_CHANGES=1000 EXTREMES_EVERY=1 $(CARGO) test --quiet --package apgstmd-tests --test boundary --test extremes --test dependencies
	@$(CARGO) test --quiet --package apgstmd-cli --test cli -- hostile::

deny: ## licences, sources and bans of every Rust package, of any system
	@tools/tool.sh cargo-deny 0.20.2
	@$(CARGO) fetch --locked --quiet
	@target/tools/bin/cargo-deny --offline check licenses bans sources --hide-inclusion-graph

sbom: ## CycloneDX list of every Rust package with licence and checksum, in target/sbom.json
	@$(CARGO) metadata --format-version 1 --locked | python3 tools/sbom.py > target/sbom.json
	@echo "target/sbom.json: $$(grep -c '"bom-ref"' target/sbom.json) packages"

agreement: ## how far the instruction sets of this machine agree, a table
	@$(CARGO) run --release --quiet --package apgstmd-tests --bin agreement

# The last release, where nothing else is said.
BASELINE ?= $(shell git describe --tags --abbrev=0 2> /dev/null)

semver: ## what has changed for programs that use the crates since BASELINE (a tag or revision), and which version that asks for
	@test -n "$(BASELINE)" || { echo "error: there is no tag to compare with: make semver BASELINE=REVISION" >&2; exit 1; }
	@tools/tool.sh cargo-semver-checks 0.51.0
	@target/tools/bin/cargo-semver-checks semver-checks --package apgstmd-core --package apgstmd-cli --baseline-rev "$(BASELINE)"

long: ## a million small frames and 20,000 of 480 x 270 on end: memory, speed, drift, time stamps; tables
	@$(CARGO) run --release --quiet --package apgstmd-tests --bin long $(FRAMES)

kills: ## runs ended at a hundred moments by SIGKILL, SIGINT and SIGTERM, and gone on with
	@KILLS=100 $(CARGO) test --quiet --package apgstmd-cli --test cli -- --nocapture resume::kills

calls: ## every system call that has to do with files fails in turn, and is where a run is killed; a table
	@command -v strace > /dev/null || (apt-get update -qq && apt-get install -qq -y strace)
	@$(CARGO) build --release --quiet --package apgstmd-cli
	@python3 tools/calls.py target/release/apgstmd

arrays: wheel ## 10,000 NumPy arrays of every kind and lie in memory, others each time
	@EXAMPLES=5000 $(PY) -m pytest --quiet python/tests/test_any_array.py

fuzz: ## fuzz every boundary for FUZZ_TIME seconds (or TARGETS="scene state"); figures in target/fuzz.csv
	@tools/tool.sh cargo-fuzz 0.13.2
	@tools/fuzz.sh $(FUZZ_TIME) $(TARGETS)

# Of rayon's threads crossbeam-epoch leaves some of what it holds behind when the process ends; the rest is checked for leaks too.
MIRI = PROPTEST_CASES=2 CARGO_TARGET_DIR=target/miri MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-tree-borrows \
	-Zmiri-permissive-provenance -Zmiri-deterministic-floats $(1)" $(CARGO) +nightly miri test --package apgstmd-core --lib --

miri: ## the rows, where all unsafe code is, under Miri
	@$(call MIRI) row::lateral row::mix row::tile row::warp plane:: tiles::
	@$(call MIRI,-Zmiri-ignore-leaks) row::workers

miri-core: ## the unit tests of the core under Miri, a whole small detector on two threads among them: an hour
	@$(call MIRI,-Zmiri-ignore-leaks)

# A test asks for more memory than there is, to be refused.
asan: ## the core and its suites under AddressSanitizer
	@ASAN_OPTIONS=allocator_may_return_null=1 PROPTEST_CASES=4 RUSTFLAGS=-Zsanitizer=address CARGO_TARGET_DIR=target/asan \
		$(CARGO) +nightly test --quiet --target $(HOST) --package apgstmd-core --lib
	@ASAN_OPTIONS=allocator_may_return_null=1 PROPTEST_CASES=4 RUSTFLAGS=-Zsanitizer=address CARGO_TARGET_DIR=target/asan \
		$(CARGO) +nightly test --quiet --target $(HOST) --package apgstmd-tests --test machine --test threads --test tiny --test state

tsan: ## the threads under ThreadSanitizer
	@RUSTFLAGS=-Zsanitizer=thread CARGO_TARGET_DIR=target/tsan \
		$(CARGO) +nightly test -Zbuild-std --quiet --target $(HOST) --package apgstmd-core --lib -- row::
	@RUSTFLAGS=-Zsanitizer=thread CARGO_TARGET_DIR=target/tsan \
		$(CARGO) +nightly test -Zbuild-std --quiet --target $(HOST) --package apgstmd-tests --test threads

docs: wheel ## the pages in target/site, API documentation of the Rust crates in target/doc; warnings are errors
	@tools/venv.sh .venv-docs tools/requirements-docs.txt
	@.venv-docs/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall $(WHEELS)/*.whl
	@.venv-docs/bin/python -m sphinx -W --keep-going --quiet -E -b html docs target/site
	@RUSTDOCFLAGS="-D warnings" $(CARGO) doc --no-deps --workspace --exclude apgstmd-py

clean: ## remove everything that was built
	@$(CARGO) clean
	@rm -rf .venv .venv-compare .venv-dist .venv-docs dist demo-out reproduce-out .mypy_cache .pytest_cache
