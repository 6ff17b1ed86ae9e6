# palpate: every target makes and reuses its own .venv; `make` alone explains.
VENV   ?= .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt
OUT    ?= runs/demo
MOMENTS ?= 10
SEED   ?= 0
BASE   ?= HEAD

# Hundreds of short processes run in tests: what Python compiles of their sources is kept.
export PYTHONDONTWRITEBYTECODE :=

.DEFAULT_GOAL := help
.PHONY: help demo test test-all mutants golden golden-compare test-pythons check format api docs build platforms faults bench figures pictures clean

help:  ## Show this list
	@echo "palpate: hybrid force control with the sense of touch"
	@echo
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):[^#]*## (.*)/  make \1|\2/' | awk -F'|' '{printf "%-20s %s\n", $$1, $$2}'
	@echo
	@echo "Each installs what it needs into $(VENV) first, with a Python that can do everything, if there is one."
	@echo "Another: make test PYTHON=python3.13 VENV=.venv-3.13"

demo: $(VENV)/.run $(VENV)/.kernels  ## Explore a simulated sphere by touch and write a report to runs/demo
	$(BIN)/palpate explore --object sphere --force 2 --speed 0.025 --force-noise 0.01 --moment-noise 1e-4 --out $(OUT)

test: $(VENV)/.test $(VENV)/.kernels  ## Run the tests that are not slow: 3 to 4 minutes on two cores
	$(BIN)/python -m pytest -m "not slow" -n auto --dist loadgroup

test-all: $(VENV)/.test $(VENV)/.kernels  ## Run every test, the long ones too: some 40 minutes on two cores
	$(BIN)/python -m pytest -m "not wire" -n auto --dist loadgroup
	$(BIN)/python -m pytest -m wire

mutants: $(VENV)/.test $(VENV)/.kernels  ## Make 300 small faults in the package and count those that the tests detect: an hour
	$(BIN)/python tests/mutants run

golden: $(VENV)/.test $(VENV)/.kernels  ## Make tests/golden/golden.json anew: metrics and commands of the golden runs
	$(BIN)/python tests/golden write

golden-compare: $(VENV)/.test $(VENV)/.kernels  ## Compare every command of the golden runs with those of the commit BASE
	$(BIN)/python tests/golden compare $(BASE)

test-pythons: $(VENV)/.test  ## Run demo and tests on every other CPython that is installed
	$(BIN)/python tests/install/every_python.py

check: $(VENV)/.check  ## Lint, check formatting, types, the direction of imports and the list of public names
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright
	$(BIN)/lint-imports
	$(BIN)/python tests/support/no_wall_clock.py tests
	$(BIN)/python docs/make_api.py --check
	$(BIN)/python docs/make_faults.py --check
	$(BIN)/python docs/make_metrics.py --check

format: $(VENV)/.check  ## Format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

api: $(VENV)/.test  ## Make docs/public-names.md, faults.md and metrics.md anew
	$(BIN)/python docs/make_api.py
	$(BIN)/python docs/make_faults.py
	$(BIN)/python docs/make_metrics.py

docs: $(VENV)/.docs $(VENV)/.kernels  ## Build the documents into build/docs; a warning fails
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going docs build/docs
	@echo "Open build/docs/index.html"

build: $(VENV)/.build  ## Build sdist and wheel, install each into a fresh environment, and try it there
	rm -rf dist build/wheel build/sdist
	$(BIN)/python -m build --outdir dist .
	$(BIN)/python tests/install/built.py dist
	$(MAKE) --no-print-directory --jobs 2 build/wheel build/sdist

# What is built: `python -m build` makes the wheel from the unpacked sdist, so that one proves the other.
build/wheel: ARCHIVE = dist/*.whl
build/sdist: ARCHIVE = dist/*.tar.gz
build/wheel build/sdist: $(VENV)/.build
	$(BIN)/python -m venv $@
	$@/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt $(ARCHIVE)
	cd $@ && bin/python $(CURDIR)/tests/install/smoke.py

platforms: $(VENV)/.build  ## Resolve the dependencies for every platform and Python, into docs/install.md
	$(BIN)/python tests/install/platforms.py docs/install.md

faults: $(VENV)/.test $(VENV)/.kernels  ## Try every kind of fault at MOMENTS random moments: hours for all of them
	$(BIN)/python benchmarks/faults --moments $(MOMENTS) --seed $(SEED)

bench: $(VENV)/.test $(VENV)/.kernels  ## Measure speed against error of contact sensing, and the cost of a control period
	$(BIN)/python benchmarks/bench.py
	$(BIN)/python tests/reference/answers.py
	$(BIN)/python benchmarks/contact.py
	$(BIN)/python benchmarks/every_tip.py
	$(BIN)/python benchmarks/explorations.py sensors
	$(BIN)/python benchmarks/surface_maps.py cost choice
	$(BIN)/python benchmarks/simulation
	$(BIN)/python benchmarks/grasp.py
	$(BIN)/python benchmarks/robust_grasps.py
	$(BIN)/python benchmarks/grip sharing --seeds 4
	$(BIN)/python benchmarks/wire
	$(BIN)/python benchmarks/wire connections
	$(BIN)/python benchmarks/costs

figures: $(VENV)/.test $(VENV)/.kernels  ## Measure the figures of README and docs anew, five minutes, and write them there
	$(BIN)/python benchmarks/figures.py

pictures: $(VENV)/.test $(VENV)/.kernels  ## Make the pictures of README and docs anew
	$(BIN)/python docs/make_pictures.py
	$(BIN)/python benchmarks/contact.py --picture docs/contact_speed_error.png
	$(BIN)/python benchmarks/simulation stage arm hand --picture docs/simulation_speed_error.png
	$(BIN)/python benchmarks/surface_maps.py sphere --picture docs/mapping_error.png
	$(BIN)/python benchmarks/tip_calibration.py map --picture docs/tip_calibration.png
	$(BIN)/python benchmarks/grasp.py least-effort --picture docs/grasp_speed_error.png

clean:  ## Remove environments, builds, caches and runs
	rm -rf .venv .venv-* build dist runs .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/python:
	python3 tests/install/choose_python.py $(VENV) $(PYTHON)

# numba looks only at the file of a cached function, not at what it inlines from others: forget all when one changes
$(VENV)/.kernels: $(BIN)/python $(shell grep -rlE 'njit' src controllers hw sim)
	find -L src -name "*.$$($(BIN)/python -c 'import sys; print("py%d%d" % sys.version_info[:2])').nbi" -delete
	@touch $@

# an unpacked sdist holds the folders but not the links to them
# a Python that is named, and an environment that has another
ifneq ($(and $(PYTHON),$(wildcard $(BIN)/python)),)
SAYS := -c "import platform; print(platform.python_version())"
ifneq ($(shell $(PYTHON) $(SAYS)),$(shell $(BIN)/python $(SAYS)))
$(error $(VENV) has CPython $(shell $(BIN)/python $(SAYS)), and PYTHON=$(PYTHON) is another: rm -r $(VENV) first, or add VENV=.venv-other)
endif
endif

LINKS := src/palpate/controllers src/palpate/hw src/palpate/sim
$(LINKS):
	ln -s ../../$(@F) $@

$(VENV)/.run: $(BIN)/python pyproject.toml constraints.txt | $(LINKS)
	$(PIP) --editable .
	@touch $@

$(VENV)/.test: $(VENV)/.run
	$(PIP) --editable ".[test]"
	@touch $@

$(VENV)/.check: $(VENV)/.test
	$(PIP) --editable ".[check,test]"
	@touch $@

$(VENV)/.docs: $(VENV)/.test
	$(PIP) --editable ".[docs,test]"
	@touch $@

$(VENV)/.build: $(BIN)/python pyproject.toml constraints.txt
	$(PIP) --editable ".[build]"
	@touch $@
