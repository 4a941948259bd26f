# One gate for people and CI. `make` lists what there is.
# A bare machine needs Python >= 3.11, gcc and make; everything else comes from the package registries, at pinned versions.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
JOBS   ?= $(shell nproc 2>/dev/null | awk '{print ($$1 > 4) ? 4 : $$1}')
BIN    := .venv/bin
UV     := $(BIN)/uv

.DEFAULT_GOAL := help
.PHONY: help run test test-ros soak setup setup-run fast test-browser campaign lint format types layers docs docs-serve figures examples kernels package lock ci clean

help:  ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-11s %s\n", $$1, $$2}'

run: setup-run  ## run the default scenario: a robot passes a person; results in runs/crossing
	$(BIN)/sidestep run crossing --out runs/crossing

test: setup  ## run every test, with coverage
	$(BIN)/pytest -n $(JOBS) --dist worksteal --benchmark-disable --cov --cov-report=term:skip-covered

setup: .venv/.locked-test  ## make .venv with everything the tests, the checks and the site need
setup-run: .venv/.locked-run

test-ros: setup .venv-ros1/.ready .venv-ros2/.ready  ## test the nodes with real ROS 1 and ROS 2 on the loopback, and a short soak
	SIDESTEP_ROS=1 $(BIN)/pytest -q tests/ros
	$(BIN)/python tests/ros/soak.py --dialect 1 --seconds 30
	$(BIN)/python tests/ros/soak.py --dialect 2 --seconds 30

soak: setup .venv-ros1/.ready .venv-ros2/.ready  ## ten minutes of each node: memory must not grow
	$(BIN)/python tests/ros/soak.py --dialect 1 --seconds 600
	$(BIN)/python tests/ros/soak.py --dialect 2 --seconds 600

.venv-ros1/.ready: tools/install-ros1.sh requirements/run.txt
	tools/install-ros1.sh
	@touch $@

.venv-ros2/.ready: tools/install-ros2.sh requirements/run.txt
	tools/install-ros2.sh
	@touch $@

fast: setup  ## run the tests that take less than a few seconds each
	$(BIN)/pytest -n $(JOBS) --dist worksteal --benchmark-disable -m "not slow" -q

test-browser: setup  ## drive the live page in Debian's chromium; pictures and measurements in results/browser
	tools/install-browser.sh $(BIN)/python
	SIDESTEP_BROWSER=1 $(BIN)/pytest tests/browser -s --benchmark-disable -p no:cacheprovider

campaign: setup  ## 100,000 random steps with faults, 100 trips of each base among random walls, 500 histories of faults that hypothesis searches, 15,000 odd planners, 400 seeds per encounter
	SIDESTEP_TRIPS=100 SIDESTEP_FAULT_STEPS=100000 SIDESTEP_FAULT_EXAMPLES=500 SIDESTEP_FAULT_PLANNERS=1000 SIDESTEP_BEHAVIOUR_SEEDS=400 $(BIN)/pytest -n $(JOBS) -q --benchmark-disable tests/test_planner_arrives.py tests/test_planner_faults.py tests/test_planner_faults_stateful.py tests/test_planner_odd_settings.py tests/test_behaviour.py

reproduction: setup  ## the paper's claims with few seeds, and whether all are there and on the page
	$(BIN)/sidestep reproduce --quick --out results/reproduction-quick
	$(BIN)/python tools/check_reproduction.py results/reproduction-quick/results.json docs/evidence/reproduction.md

kernels: setup  ## compile the inner loops, once
	$(BIN)/sidestep run crossing --json >/dev/null

lint: setup  ## ruff: rules and format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: setup  ## pyright, strict
	$(BIN)/pyright

layers: setup  ## imports point down (import-linter)
	$(BIN)/lint-imports

format: setup  ## mend what ruff can mend
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: setup  ## build the site, strictly, into site/
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
	$(BIN)/python tools/check_links.py site

docs-serve: setup  ## serve the site on this machine, rebuilt at every change
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs serve

figures: setup  ## remake the pictures of the README and the site
	$(BIN)/python tools/make_figures.py

examples: setup  ## run all examples; pictures in runs/examples
	$(BIN)/python tools/run_examples.py

package: setup  ## build wheel and sdist, and run the quickstart from the wheel in an empty environment
	tools/check_package.sh

lock: setup-run  ## renew requirements/*.txt within the bounds of pyproject.toml
	tools/lock.sh

ci: ## what CI runs
	.ci/run

clean:  ## remove what was built (not .venv, not runs/)
	rm -rf build dist site .pytest_cache .ruff_cache .import_linter_cache .coverage

.venv/bin/uv:
	tools/make_venv.sh "$(PYTHON)"

# --no-deps on the project itself: what it needs is in the lock already.
.venv/.locked-run: requirements/run.txt pyproject.toml | .venv/bin/uv
	$(UV) pip install --python $(BIN)/python --quiet -r requirements/run.txt
	$(UV) pip install --python $(BIN)/python --quiet --no-deps --no-build-isolation --editable .
	@touch $@

.venv/.locked-test: requirements/test.txt .venv/.locked-run
	$(UV) pip install --python $(BIN)/python --quiet -r requirements/test.txt
	@touch $@
