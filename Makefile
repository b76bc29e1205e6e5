# make demo, make test: each does its own set-up. Needs Python 3.11 or newer, a C++17 compiler and make.
SHELL := bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

PYTHON ?= python3
VENV := .venv
PRODUCTS := packages/streetworld packages/dreamdrive_train benchmarks
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
# One thread of torch for each of the two workers.
PYTEST := OMP_NUM_THREADS=1 $(BIN)/python -m pytest
PARALLEL ?= -n 2 --dist worksteal

# Where the demo's results go, and what is reconstructed; nothing means the built-in street.
OUT ?= $(if $(INPUT),demo/clip,demo/street)
INPUT ?=
OPTIONS ?=

.PHONY: help install demo test ci check site sanitize page snapshots wheels format clean

help:
	@echo "make demo [INPUT=clip.mp4] [OUT=demo/street] [OPTIONS='--quality draft']   a scene and its videos"
	@echo "make test      the quick tests"
	@echo "make ci        lint, types, sanitizers, the site, the viewer's page, slow tests, examples"
	@echo "make site      the documentation as a site, into build/site"
	@echo "make page      the viewer in Chromium"
	@echo "make snapshots the texts that tests keep, anew"
	@echo "make wheels    wheels for Linux into dist/ [PYTHONS='python3.11 python3.12']"
	@echo "make install   only the set-up, into $(VENV)"

# Third-party packages, pinned; again only when what is wanted changes.
$(VENV)/.packages: constraints.txt pyproject.toml benchmarks/pyproject.toml
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("Python 3.11 or newer is needed, $(PYTHON) is " + sys.version.split()[0] + "; choose another with make PYTHON=...")'
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --quiet --constraint constraints.txt scikit-build-core nanobind cmake ninja
	@touch $@

# The package itself: Python is used in place, the C++ core is compiled.
$(VENV)/.installed: $(VENV)/.packages CMakeLists.txt $(wildcard native/*/*) $(PRODUCTS:%=%/pyproject.toml)
	$(PIP) install --quiet --constraint constraints.txt --no-build-isolation --editable '.[dev]' $(PRODUCTS:%=--editable ./%)
	@touch $@

install: $(VENV)/.installed

demo: install
	$(BIN)/dreamdrive generate $(if $(INPUT),'$(INPUT)',--prior street-world) --out '$(OUT)' $(OPTIONS)
	@echo "Watch $(OUT)/video: drive.mp4, shift.mp4 where aside is trusted, recorded_beside_rendered.mp4, panels.mp4"

test: install
	$(PYTEST) $(PARALLEL) -m "not slow and not gpu"

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

# Warnings, of links to nowhere and of pages outside the navigation, are errors; so is what a page would fetch.
site: install
	$(BIN)/python -m sphinx -W --keep-going -q -b html -c docs/site -d build/site/.doctrees . build/site
	@! grep -rlE '(src|href)="(https?:)?//[^"]+\.(js|css|woff2?)"' build/site --include='*.html'

# The tests of splatting on a core compiled with AddressSanitizer and UndefinedBehaviorSanitizer.
sanitize: install
	.ci/sanitize

# The viewer in headless Chromium, which is installed where it is missing.
page: install
	.ci/page

ci: check sanitize site page
	$(PYTEST) $(PARALLEL) -m "slow and not gpu and not page"
	@for example in examples/[0-9]*.py; do echo "$$example"; $(BIN)/python "$$example" --out "out/examples/$$(basename "$$example" .py)" || exit 1; done

# Public names, messages and pages that tests compare with: look at the difference before it is committed.
snapshots: install
	DREAMDRIVE_SNAPSHOTS=renew $(PYTEST) --quiet tests/test_public_names.py tests/cli/test_messages.py \
		tests/cli/test_commands_document.py tests/run/test_options_page.py tests/test_examples.py

wheels:
	packaging/wheels $(PYTHONS)

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf build demo out
