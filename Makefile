# make demo   pictures of a real CT, the truth beside them, a table of errors: in demo/
# make test   lint, then all tests
# make lint   ruff: rules and format
# make wheel  dist/persp_sw-….whl
# make clean  remove what these made, the virtual environment too
#
# Each sets up what it needs: a virtual environment in .venv with the versions of constraints.txt, and for the
# tests Mesa's EGL and Xvfb from the system's packages. PYTHON=python3.12 chooses the interpreter of
# a new environment.

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
TEST_ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help demo test lint wheel clean system

help:
	@sed -n 's/^# \{0,1\}//; /^$$/q; p' Makefile

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  { echo "error: Python 3.10 or newer is needed; $$($(PYTHON) --version) found. Try: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	@echo "setting up .venv (again only when pyproject.toml or constraints.txt change)"
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear .venv || \
	  { echo "error: cannot make a virtual environment; on Debian: apt-get install python3-venv"; exit 1; }
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[view,panel,movie,demo,vtk,bench,test]'
	@touch $@

demo: $(READY)
	$(BIN)/persp-sw demo -o demo

test: system lint
	$(BIN)/python -m pytest -q --durations=15 $(TEST_ARGS)

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

wheel: $(READY)
	$(BIN)/python -m pip wheel --quiet --disable-pip-version-check --no-deps -w dist .
	@ls dist/*.whl

system:
	@sh .ci/system_packages.sh

clean:
	rm -rf .venv build dist demo *.egg-info .pytest_cache .ruff_cache
	find persp_sw vr_plugin tests -name __pycache__ -prune -exec rm -rf {} +
