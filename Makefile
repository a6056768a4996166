# Developers and CI run the same commands. Needs python3 (3.11 to 3.14) with its venv module, and make.
PYTHON ?= python3
LOWEST_PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
# Files in their order: the slow ones (browser) first, so that no worker is left with one at the end.
PARALLEL := -n logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder
FAST := tests/golden tests/paper tests/properties $(wildcard tests/unit/test_*.py) \
  $(addprefix tests/unit/,association diagnostics estimation interchange results)

.PHONY: help env dev demo docs dist test test-all fuzz test-fast test-lowest test-newest check lock bench bench-accuracy paper sample image clean

help:  ## List the targets.
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

env: $(VENV)/.runtime  ## Create .venv with the program.

dev: $(VENV)/.dev  ## The same, with the tools for tests and checks.

$(BIN)/python:
	@PYTHON="$(PYTHON)" VENV="$(VENV)" sh .ci/make_venv

$(VENV)/.runtime: requirements/runtime.txt pyproject.toml | $(BIN)/python
	@VENV="$(VENV)" sh .ci/install requirements/runtime.txt
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

$(VENV)/.dev: requirements/dev.txt $(VENV)/.runtime
	@VENV="$(VENV)" sh .ci/install requirements/dev.txt
	@touch $@

$(VENV)/.docs: requirements/docs.txt $(VENV)/.runtime
	@VENV="$(VENV)" sh .ci/install requirements/docs.txt
	@touch $@

$(VENV)/.bench: requirements/bench.txt $(VENV)/.dev
	@VENV="$(VENV)" sh .ci/install requirements/bench.txt
	@touch $@

demo: env  ## Open the sample recording in the browser.
	$(BIN)/cocalib demo

docs: $(VENV)/.docs  ## Build the documentation as a site in app/cocalib/site, which the page serves under Help: offline and strict.
	$(BIN)/python docs/make_site.py

dist: dev docs  ## Build wheel and sdist in dist/, and test them in an empty environment with the pins.
	rm -rf dist
	$(BIN)/python -m hatchling build -d dist
	COCALIB_DIST=dist $(BIN)/pytest -q tests/architecture/test_wheel.py

check: dev  ## Check style, types, layers, frame names, spelling.
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/typos
	$(BIN)/pytest -q -m "not slow" tests/architecture
	@$(BIN)/python .ci/structure.py grown
	@$(BIN)/python .ci/installed_size

test: dev  ## Run the tests, including those in the browser, but for the slow ones; those of the architecture belong to make check.
	@$(BIN)/python tests/find_browser.py --install
	$(BIN)/pytest $(PARALLEL) -m "not slow" --ignore tests/architecture --ignore tests/accuracy

test-all: dev  ## Run everything: the slow ones, the wheel, and tests/accuracy, which solves many simulated sets.
	@$(BIN)/python tests/find_browser.py --install
	$(BIN)/pytest $(PARALLEL)

test-fast: dev  ## Run the core's tests, in under a minute of processor time.
	$(BIN)/pytest -q -m "not slow and not real" $(FAST)

fuzz: dev  ## Fuzz every reader, guided by coverage; the corpus grows in .fuzz/. FUZZ="--seconds 3600 --target mcap".
	$(BIN)/python -m tests.fuzz $(FUZZ)

test-lowest:  ## Run part of the tests with the lowest versions that pyproject.toml allows (needs python3.11 and the package index).
	@$(LOWEST_PYTHON) .ci/test_bounds lowest

test-newest:  ## The same with the newest allowed versions.
	@$(PYTHON) .ci/test_bounds newest

bench: dev  ## Measure speed; write docs/speed.md. BENCH=--large also opens 5 GB and 100 GB.
	@$(BIN)/python tests/find_browser.py --install
	$(BIN)/python -m benchmarks.speed $(BENCH)

bench-accuracy: SEED ?= fixed
bench-accuracy: $(VENV)/.bench  ## Measure accuracy against the bound and other estimators; write docs/accuracy.md and its tables (about 40 min on one core). SEED=fresh: draws from the commit's hash.
	$(BIN)/python -m benchmarks.accuracy --seed $(SEED) $(ACCURACY)

paper: dev  ## Repeat the paper's experiments on simulated sessions; write docs/paper-experiments.md and its figures.
	$(BIN)/python -m benchmarks.paper $(PAPER)

sample: env  ## Regenerate sample_data/.
	$(BIN)/python -m benchmarks.sample sample_data

image: dev  ## Retake the README's images.
	@$(BIN)/python tests/find_browser.py --install
	$(BIN)/python docs/take_images.py

lock: dev  ## Update all pins, with hashes and without index URLs (needs uv).
	@sh .ci/lock

clean:  ## Remove the files created by make and the tests.
	rm -rf $(VENV) $(VENV)-lowest $(VENV)-newest $(VENV)-beyond .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache dist app/cocalib/site
