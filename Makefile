# On a machine with Python 3.11 or later and nothing else: make demo, make test, make check.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check -q
OUT    ?= out
PAGE   := tracking/playground
# Where the package index gives a CUDA build of torch, its makers' index of CPU builds saves gigabytes:
# make demo TORCH="torch==2.13.0 --index-url https://download.pytorch.org/whl/cpu"
TORCH  ?= torch==2.13.0

.PHONY: web demo test test-slow test-pythons fuzz check docs wheel wheels clean

$(VENV)/base: pyproject.toml tested-versions.txt
	$(PYTHON) -m venv $(VENV)
	@# torch first and by its exact version: a range, or another package's need, may bring another build.
	$(PIP) install -c tested-versions.txt $(TORCH)
	$(PIP) install -c tested-versions.txt -e '.[train,view]'
	@touch $@

$(VENV)/dev: $(VENV)/base
	$(PIP) install -c tested-versions.txt -e '.[train,view,music,c3d,sim2sim,deploy,robots,models,scale,gpu,dev]'
	@touch $@

# Commands exit with 1 when they are done but below a gate; the demo goes on and says so.
demo: $(VENV)/base
	@mkdir -p $(OUT)
	@rm -rf $(OUT)/run
	$(BIN)/dance-retarget clips/samples/groove.csv -o $(OUT)/groove.npz || test $$? -eq 1
	$(BIN)/dance-eval groove-dancer --rollouts 50 --recording $(OUT)/dance.rrd || test $$? -eq 1
	$(BIN)/dance-train --ref $(OUT)/groove.npz -o $(OUT)/run --minutes 2 || test $$? -eq 1
	@echo
	@echo "Look at it:"
	@echo "  $(BIN)/rerun $(OUT)/dance.rrd           a trained policy that dances it all, beside the ghost"
	@echo "  $(BIN)/dance-view $(OUT)/groove.npz     the dance in the browser"
	@echo "  $(BIN)/rerun $(OUT)/groove.rrd          the clip, the targets, the robot, its feet"
	@echo "  $(BIN)/rerun $(OUT)/run/training.rrd    what a policy was taught in two minutes"
	@echo "  $(BIN)/dance-play groove-g1             a Unitree G1, live"
	@echo "Go on: $(BIN)/dance-train --ref $(OUT)/groove.npz -o $(OUT)/run --resume"

# As many processes as cores, four at most: each has a robot, a compiler and half a gigabyte.
WORKERS ?= auto
PARALLEL := -n $(WORKERS) --maxprocesses 4
# Rehearsals run in real time: they have the machine to themselves.
REALTIME := tests/tracking/deploy
test: $(VENV)/dev
	$(BIN)/python -m pytest $(PARALLEL) --dist loadfile --ignore=$(REALTIME)
	$(BIN)/python -m pytest $(REALTIME)

test-slow: $(VENV)/dev
	$(BIN)/python -m pytest $(PARALLEL) -m slow --ignore=$(REALTIME)
	$(BIN)/python -m pytest -m slow $(REALTIME)

# Damaged files at every door: make fuzz MINUTES=60
MINUTES ?= 1
fuzz: $(VENV)/dev
	OMP_NUM_THREADS=1 $(BIN)/python tests/fuzzing/run.py --minutes $(MINUTES) --keep $(OUT)/fuzzing

check: $(VENV)/dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	for example in examples/*.py; do $(BIN)/mypy $$example || exit 1; done

# The site of the documentation, in out/site; a broken link fails it.
docs: $(VENV)/base
	$(PIP) install -c tested-versions.txt -e '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python scripts/docs_site.py $(OUT)/site
	@# The policies that come with the package, to be played with, where their page's parts are built.
	test ! -f $(PAGE)/built/playground.js || for name in groove-dancer groove-g1; do \
	  $(BIN)/dance-export $$name --web $(OUT)/site/play/$$name.html || exit 1; done

# The parts of a policy's page, from JavaScript and its packages: Node.js 20 or later. Without it the wheel has none.
web: $(PAGE)/built/playground.js
$(PAGE)/built/playground.js: $(PAGE)/web/package-lock.json $(wildcard $(PAGE)/web/src/*.js)
	mkdir -p $(PAGE)/built
	cd $(PAGE)/web && npm ci --ignore-scripts --no-audit --no-fund && npm run build

wheel: $(VENV)/dev
	rm -rf dist build
	$(PIP) wheel --no-deps -w dist .

# Which machines and Pythons the tested set has wheels for, asked of the package index.
wheels: $(VENV)/dev
	$(BIN)/python scripts/wheels.py

# The tests that need no torch, on every other Python that is on this machine.
test-pythons: wheel
	scripts/other_pythons.sh

clean:
	rm -rf $(VENV) build dist $(OUT) *.egg-info .mypy_cache .ruff_cache .pytest_cache
