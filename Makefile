# make impact   one real tennis impact, with numbers, a log and a plot in impact_out/
# make test     the tests
# Each makes .venv if needed and installs the project there. PYTHON=python3.12 takes another Python.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: impact test check clean

impact: $(VENV)/.installed-fast
	$(BIN)/drake-racket impact --out impact_out

test: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n auto

check: $(VENV)/.installed-test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

# ensures the virtual environment, then installs one extra into it
$(VENV)/.installed-%: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable ".[$*]"
	touch $@

clean:
	rm -rf $(VENV) impact_out
