# make validate   set everything up and run the main job: theory against MuJoCo, with a verdict
# make mutants    which claims notice a wrong theory or a wrong engine? writes docs/mutants.md (two hours or more)
# make blind SEED=n  a round with sets and faults that the seed draws, added to docs/blind.md (a quarter of an hour or more)
# make test       set everything up and run the tests
# make test-all   the slow tests, too
# make benchmarks the figures of speed, as ratios in one run: writes the tables of docs/records/speed.md
# make docs       build the documentation, run its notebooks: docs/_build/html/index.html
# make wheel      build sdist and wheel, and try the wheel in an empty environment
# make check      what CI runs: wheel, lint, types, import contracts; a quick validation; docs, a small league and what
#                 wrong theories show; tests
# make league     physics engines on exact contact cases: those that have a wheel, Siconos where the system has it
# make help       this list
# make lock       resolve the dependencies anew (needs uv)

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
RESULTS ?= results
# Bytecode is kept: else each process compiles all that it imports, for seconds, and checks start hundreds of them.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help validate mutants blind verdicts measured trial league test test-all benchmarks docs wheel check prepared tried lint lock clean

validate: $(VENV)/installed
	$(BIN)/dualball validate --quick

help:
	@sed -n 's/^# //p' $(firstword $(MAKEFILE_LIST))

mutants: $(VENV)/installed
	$(BIN)/dualball validate --quick --quiet
	$(BIN)/dualball validate --quiet -o results/default
	$(BIN)/python -m tests.mutants results results/default --whole --engines --alone mujoco-plain --least 0.95 --page docs/mutants.md

blind: $(VENV)/installed
	$(BIN)/python -m tests.mutants.blind $(SEED)

test: $(VENV)/installed-dev
	$(BIN)/pytest -n 2 --dist worksteal

test-all: $(VENV)/installed-dev
	$(BIN)/pytest -n 2 --dist worksteal -m "slow or not slow"

benchmarks: $(VENV)/installed-dev
	$(BIN)/python -m docs.studies.speed docs/records/speed.md

verdicts:
	$(MAKE) measured
	$(MAKE) trial

measured: $(VENV)/installed
	$(BIN)/dualball validate --quick --quiet -o $(RESULTS)

trial: $(VENV)/installed
	$(BIN)/python -m tests.mutants $(RESULTS) --least 0.95

lint: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs: $(VENV)/installed-docs
	$(BIN)/sphinx-build -q -W --keep-going docs docs/_build/html

wheel:
	.ci/wheel $(PYTHON)

check:
	$(MAKE) -j 2 wheel prepared
	$(MAKE) -j 2 docs tried

prepared:  # measuring has a process for each processor, and compiles what the others then load
	$(MAKE) -j 1 $(VENV)/installed-dev $(VENV)/installed-engines lint measured

tried:
	$(MAKE) -j 1 league trial test

league: $(VENV)/installed-engines
	$(BIN)/dualball league --quick --quiet -o $(RESULTS)

$(VENV)/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "dualball needs Python 3.11 or newer; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@.ci/install $(BIN)/python requirements.lock -e .
	@touch $@

$(VENV)/installed-dev: requirements-dev.lock $(VENV)/installed
	@.ci/install $(BIN)/python requirements-dev.lock
	@touch $@

$(VENV)/installed-docs: requirements-docs.lock $(VENV)/installed-dev
	@.ci/install $(BIN)/python requirements-docs.lock
	@touch $@

ENGINES := drake pybullet
$(VENV)/installed-engines: requirements-engines.lock $(VENV)/installed
	@for engine in $(ENGINES); do \
	    awk -v own=$$engine -v all="$(ENGINES)" 'BEGIN { n = split(all, each, " ") } \
	        /^[a-z]/ { on = 1; for (k = 1; k <= n; k++) if (each[k] != own && index($$0, each[k] "==") == 1) on = 0 } on' \
	        $< >$(VENV)/$$engine.txt; \
	    PIP_ONLY_BINARY=:all: .ci/install $(BIN)/python $(VENV)/$$engine.txt || \
	        echo "the league goes on without $$engine, which has no wheel for this Python"; \
	done
	@touch $@

lock:
	uv pip compile --universal --generate-hashes --no-header --no-emit-index-url --python-version 3.11 pyproject.toml --extra xarray -o requirements.lock
	uv pip compile --universal --generate-hashes --no-header --no-emit-index-url --python-version 3.11 --group docs -c requirements.lock -o requirements-docs.lock
	uv pip compile --universal --generate-hashes --no-header --no-emit-index-url --python-version 3.11 pyproject.toml --extra xarray --group dev -c requirements.lock -c requirements-docs.lock -o requirements-dev.lock
	echo $(ENGINES) | tr ' ' '\n' | uv pip compile --universal --generate-hashes --no-header --no-emit-index-url --python-version 3.11 pyproject.toml - -c requirements.lock -o requirements-engines.lock

clean:
	rm -rf $(VENV) build docs/_build docs/api *.egg-info
