# Every target works in a fresh clone with no virtual environment active, and is quick when nothing
# changed. `.venv` belongs to this file: it is made, and when this folder was moved remade, from PYTHON.

PYTHON ?= python3
RUST_MINOR := $(shell sed -n 's/^rust-version = "1\.\([0-9]*\).*/\1/p' Cargo.toml)

PY  := .venv/bin/python
PIP := $(PY) -m pip --disable-pip-version-check --quiet

# One empty file for each step done. An environment does not survive being moved or copied (its paths
# are absolute, so a copy would test the original's sources): the name holds a checksum of where we are.
DONE := .venv/.done-$(firstword $(shell pwd -P | cksum))

# The install is editable: an edit to a Python file needs no step, so only these do.
BUILT_FROM := pyproject.toml Cargo.toml Cargo.lock \
              $(shell find rust -name '*.rs' -o -name Cargo.toml)
BUILD_REQUIRES = $(PY) -c 'import tomllib; \
  print("\n".join(tomllib.load(open("pyproject.toml", "rb"))["build-system"]["requires"]))'

# In CI a Cargo.lock that does not fit the manifests is an error; elsewhere cargo mends it.
LOCKED := $(if $(CI),--locked)

# Nothing of the caller's Python may leak in, nor may pip install elsewhere than in .venv.
unexport VIRTUAL_ENV CONDA_PREFIX CONDA_DEFAULT_ENV PYTHONPATH PYTHONHOME
unexport PIP_USER PIP_TARGET PIP_PREFIX PIP_ROOT PIP_PYTHON
export PYO3_PYTHON := $(CURDIR)/$(PY)

.DEFAULT_GOAL := help
.NOTPARALLEL: # two pips in one environment, or two cargos in one target folder, only get in each other's way
.PHONY: help run test bench lint golden clean

help: ## list the targets
	@sed -n 's/^\([a-z]*\):.*## \(.*\)/make \1\t\2/p' Makefile | expand -t 14

run: $(DONE)-package ## the paper's case: a summary, and out/result.nc with its plots
	.venv/bin/pavefem run --out out

test: $(DONE)-package $(DONE)-test ## the Rust tests, then the Python tests
	cargo test $(LOCKED)
	$(PY) -m pytest

bench: $(DONE)-package $(DONE)-test $(DONE)-peers ## our own benches, then the same work in other codes
	cargo bench $(LOCKED)
	$(PY) benches/peers.py
	$(PY) benches/fleet.py
	$(PY) benches/sobol.py

lint: $(DONE)-package $(DONE)-test $(DONE)-lint ## formatting, lints, types, and the stub against the binary
	cargo fmt --all --check
	cargo clippy $(LOCKED) --workspace --all-targets -- -D warnings
	$(PY) -m ruff check
	$(PY) -m ruff format --check
	$(PY) -m mypy
	$(PY) -m mypy.stubtest --mypy-config-file pyproject.toml pavefem._core

golden: $(DONE)-package $(DONE)-test ## regenerate the golden data; say in the commit why it changed
	$(PY) tests/golden/regenerate.py

clean: ## remove all that is built, .venv and out/ too
	rm -rf .venv target out python/pavefem/_core*.so python/pavefem/_core*.pyd
	rm -rf .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find python tests benches examples -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

# What is missing is said first and in one line, else it surfaces in the middle of a page of pip's.
# Dependency groups need pip >= 25.1, and Python 3.11 to 3.13 bundle an older one.
$(DONE)-venv:
	@fail() { echo "pavefem: $$*" >&2; exit 1; }; \
	"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
	  fail "needs Python >= 3.11, and '$(PYTHON)' is missing or older: install it, or name one with PYTHON=/path/to/python3"; \
	"$(PYTHON)" -c 'import ensurepip, venv' 2>/dev/null || \
	  fail "'$(PYTHON)' cannot make virtual environments: install its venv module (Debian, Ubuntu: apt install python3-venv)"; \
	cargo --version >/dev/null 2>&1 || \
	  fail "needs Rust >= 1.$(RUST_MINOR), and cargo is missing: install it from https://rustup.rs"; \
	minor=$$(rustc --version 2>/dev/null | cut -d. -f2); [ "$${minor:-0}" -ge $(RUST_MINOR) ] || \
	  fail "needs Rust >= 1.$(RUST_MINOR), and rustc is missing or older: rustup update stable"
	@echo "making .venv"
	@"$(PYTHON)" -m venv --clear .venv
	@$(PIP) install 'pip>=25.1'
	@touch $@

# Without build isolation, so that a rebuild needs no network; maturin builds the release profile and
# is looked for in PATH.
$(DONE)-package: $(BUILT_FROM) | $(DONE)-venv
	@echo "installing pavefem into .venv (the first build takes a minute or two)"
	@$(BUILD_REQUIRES) | $(PIP) install --requirement /dev/stdin
	@PATH="$(CURDIR)/.venv/bin:$$PATH" MATURIN_PEP517_ARGS="$(LOCKED)" \
	  $(PIP) install --no-build-isolation --editable .
	@touch $@

$(DONE)-test $(DONE)-lint: $(DONE)-%: pyproject.toml | $(DONE)-venv
	@echo "installing the $* dependencies"
	@$(PIP) install --group $*
	@touch $@

# Not every peer has a wheel for every platform: peers.py leaves out what is missing.
$(DONE)-peers: pyproject.toml | $(DONE)-venv
	@echo "installing the peers"
	@$(PIP) install --only-binary :all: --group peers && touch $@ || echo "not all could be installed: continuing"
