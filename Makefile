# Two commands matter: `make walk` and `make test`. Both install first, into .venv.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
IS_NEW_ENOUGH := import sys; sys.exit(sys.version_info < (3, 11))
PYTHON ?= $(shell for name in python3 python3.13 python3.12 python3.11; do \
	$$name -c '$(IS_NEW_ENOUGH)' 2>/dev/null && { echo $$name; break; }; done)
PEERS := .venv-peers
ARGS ?=

# What the simulated camera draws with: MuJoCo's pictures off the screen, on the processor.
# OSMesa is one library; systems that do not have it any more have EGL.
GRAPHICS := libosmesa6
OTHER_GRAPHICS := libegl1 libopengl0 libgl1-mesa-dri
CAN_DRAW = env -u MUJOCO_GL $(BIN)/python -c 'from bluefoot_mpc.sim.graphics import chosen_library; chosen_library()'

# The matrices are small: threads of the linear algebra cost more than they bring.
export OMP_NUM_THREADS ?= 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help setup walk test lint figures peers lock clean

help: ## this list
	@echo "make walk    install what is needed and walk the simulated robot"
	@echo "make test    install what is needed and run the tests"
	@echo "make setup   only install, into $(VENV)"
	@echo "make lint    style, types, layers, generated files"
	@echo "make figures measure every figure of the README (long; resumes where it stopped)"
	@echo "make peers   time our stages beside other projects' (installs them into $(PEERS))"
	@echo "make lock    pin the dependencies anew (needs uv)"
	@echo "make clean   remove $(VENV), caches and builds (runs/ stays)"
	@echo
	@echo "ARGS=... is passed on:  make walk ARGS=\"--speed 0.06 --seed 3\""

setup: $(STAMP) ## only install
	@echo "Installed in $(VENV). Next: make walk, or $(BIN)/bluefoot --help"

$(STAMP): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { \
		echo "Python 3.11 or newer is needed; none of python3, python3.13, python3.12, python3.11 is one." >&2; \
		echo "Debian and Ubuntu: apt install python3 python3-venv. Another place: make PYTHON=/path/to/python" >&2; \
		exit 1; }
	@$(PYTHON) -c '$(IS_NEW_ENOUGH)' || { \
		echo "$(PYTHON) is not Python 3.11 or newer" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) comes without venv. Debian and Ubuntu: apt install python3-venv" >&2; exit 1; }
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	@echo "Installing into $(VENV) (about a minute) ..."
	@$(BIN)/python -m pip install --quiet --require-hashes --only-binary :all: -r requirements.lock
	@$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --no-index -e .
	@$(CAN_DRAW) 2>/dev/null || { test "$$(id -u)" = 0 && command -v apt-get >/dev/null && { \
		echo "Installing $(GRAPHICS), which the simulated camera needs ..."; \
		apt-get update -qq && { apt-get install -y -qq --no-install-recommends $(GRAPHICS) || \
		apt-get install -y -qq --no-install-recommends $(OTHER_GRAPHICS); }; } >&2; } || true
	@$(CAN_DRAW) 2>/dev/null || { \
		echo "Everything but the simulated camera works. Its pictures need OSMesa or EGL;"; \
		echo "Debian and Ubuntu: apt install $(GRAPHICS)  (or: $(OTHER_GRAPHICS))"; } >&2
	@touch $@

walk: $(STAMP) ## the main job
	@$(BIN)/bluefoot run walk $(ARGS)

test: $(STAMP) ## all tests
	@$(BIN)/python -m pytest -n auto $(ARGS)

lint: $(STAMP) ## style, types, layers, generated files
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(BIN)/python .ci/check_lock.py
	$(BIN)/bluefoot model urdf --check

figures: $(STAMP) ## every figure of the README
	@$(BIN)/python benchmarks/figures.py $(ARGS)

peers: $(PEERS)/.installed ## our stages beside other projects'
	@PYTHONPATH=. $(PEERS)/bin/python benchmarks/peers/run.py $(ARGS)

# TSID and PlaCo need another Pinocchio than ours: an environment of their own.
$(PEERS)/.installed: benchmarks/peers/requirements.txt
	@$(PEERS)/bin/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(PEERS)
	@echo "Installing the peers into $(PEERS) (some minutes) ..."
	@$(PEERS)/bin/python -m pip install --quiet --only-binary :all: -r $<
	@touch $@

lock: ## pin the dependencies anew
	@uv pip compile pyproject.toml --extra dev --universal --python-version 3.11 \
		--generate-hashes --no-emit-index-url --no-emit-find-links --no-annotate \
		--custom-compile-command "make lock" --upgrade --quiet -o requirements.lock

clean: ## remove what was installed and built
	rm -rf $(VENV) $(PEERS) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
