# make impact   one real tennis impact, with numbers, a log and a plot in impact_out/
# make test     the tests
# make validate   the validation report in docs/validation/, in a few minutes
# make docs   the manual in site/; open site/index.html    make tutorials   run its notebooks again
# make check  format, lint and types      make sdf   the models under sdf/, from the parameters
# Each makes .venv if needed and installs the project there. PYTHON=python3.12 takes another Python.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin

.PHONY: impact test validate docs tutorials check sdf clean

impact: $(VENV)/.installed-fast
	$(BIN)/drake-racket impact --out impact_out

test: $(VENV)/.installed-test
	$(BIN)/python -m pytest -n auto

validate: $(VENV)/.installed-fast
	$(BIN)/drake-racket validate --out docs/validation

docs: $(VENV)/.installed-docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

tutorials: $(VENV)/.installed-docs
	$(BIN)/python -m manual.tutorials

check: $(VENV)/.installed-test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

sdf: $(VENV)/.installed-test
	$(BIN)/python -c 'from drake_racket.limbs.shipped import write_shipped_models as w; w()'

# ensures the virtual environment, then installs one extra into it
$(VENV)/.installed-%: pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable ".[$*]"
	touch $@

clean:
	rm -rf $(VENV) impact_out site
