# Every target makes the virtual environment it needs from the hashed locks, then works in it.
# A second make finds the stamps and installs nothing.
#
#   make demo     recover a known coating from its micrograph and its goniometer scan
#   make test     the tests that take seconds; test-all adds the slow ones
#   make lint     style, types and the layer rule
#   make stability  the table of numerical hazards with what was measured of each
#   make fuzz     damaged files of every format against the readers (COUNT=10000)
#   make faults   kills, twin runs and full disks against real runs (KILLS=50 TWINS=20)
#   make bench    speed as ratios, then run time against true error (BENCH=--quick)
#   make studies  the study folders
#   make docs     the documentation as a web site     make lock      renew the locks

SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo demo-seeds test test-all lint stability fuzz faults bench studies docs lock clean

# The first interpreter that starts and is new enough; set PYTHON to choose another
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)

BIN := .venv/bin
UV := VIRTUAL_ENV=$(CURDIR)/.venv $(BIN)/uv
INSTALL := $(UV) pip install --quiet --require-hashes
OUTPUT ?= demo-output

help:
	@sed -n 's/^#   //p' Makefile

.venv/.installer: locks/installer.lock
	@test -n "$(PYTHON)" || { echo "Python 3.11 or newer is needed; set PYTHON=..." >&2; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r $<
	@touch $@

.venv/.run: locks/run.lock pyproject.toml | .venv/.installer
	@echo "Installing into .venv ..."
	@$(INSTALL) -r $<
	@$(UV) pip install --quiet --no-deps --no-build-isolation --editable .
	@touch $@

.venv/.dev: locks/dev.lock .venv/.run
	@$(INSTALL) -r $<
	@touch $@

.venv/.all: locks/all.lock .venv/.dev
	@$(INSTALL) -r $<
	@touch $@

demo: .venv/.run
	@$(BIN)/python examples/demo.py --output $(OUTPUT)

demo-seeds: .venv/.run
	@$(BIN)/python examples/seeds.py

test: .venv/.dev
	$(BIN)/python -m pytest -n auto --dist worksteal

test-all: .venv/.dev
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not bench"

lint: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -q tests/test_layers.py

stability: .venv/.dev
	$(BIN)/python -m pytest -q -n auto --dist worksteal -m "not bench" --stability tests/hazards \
		tests/laws/test_tracer_symmetry.py tests/statistical/test_tracer_error_bars.py \
		tests/analytic/test_tracer_facets.py tests/contaminants/test_films.py \
		tests/contaminants/test_drops_exact.py

COUNT ?= 2000
fuzz: .venv/.dev
	PYTHONPATH=. $(BIN)/python tests/fuzz/run.py --count $(COUNT)
	PYTHONPATH=. $(BIN)/python tests/fuzz/commands.py

KILLS ?= 50
TWINS ?= 20
faults: .venv/.dev
	PYTHONPATH=. $(BIN)/python tests/faults/run.py --kills $(KILLS) --twins $(TWINS)

# What python -m pbrdf.bench is told: --quick --case rough, say
BENCH ?=
bench: .venv/.all
	$(BIN)/python -m pytest -m bench -s
	$(BIN)/python -m pbrdf.bench $(BENCH)

# One of them: make studies STUDY=real_coatings; those with a quick mode: make studies QUICK=1
STUDY ?= *
QUICK ?=
WITH := $(if $(QUICK),"--quick",__main__)
studies: .venv/.all
	@set -e; for script in $$(grep -l -e $(WITH) studies/$(STUDY)/*.py); do \
		echo "== $$script"; PYTHONPATH=. $(BIN)/python $$script $(if $(QUICK),--quick); done

docs: .venv/.dev
	PYTHONPATH=. $(BIN)/python docs/make_pages.py
	$(BIN)/mkdocs build --strict --quiet

COMPILE := $(UV) pip compile --universal --python-version 3.11 --generate-hashes \
	--no-header --no-annotate --quiet

lock: .venv/.installer
	$(COMPILE) --all-extras pyproject.toml -o locks/all.lock
	$(COMPILE) -c locks/all.lock --extra dev --extra docs --extra formats --extra sun --extra sweeps \
		pyproject.toml -o locks/dev.lock
	$(COMPILE) -c locks/all.lock pyproject.toml -o locks/run.lock
	$(COMPILE) -c locks/all.lock locks/installer.in -o locks/installer.lock

clean:
	rm -rf .venv build dist site $(OUTPUT) ./*.egg-info
