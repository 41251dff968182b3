# make demo | make test need nothing but Python >= 3.11 and its venv module.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
PIP    := $(BIN)/python -m pip --quiet --disable-pip-version-check

.PHONY: demo test test-slow lint docs bench clean

$(VENV)/installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "jaxphys needs Python >= 3.11; name one: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(PIP) install --constraint constraints.txt --editable .
	@touch $@

$(VENV)/installed-test: $(VENV)/installed
	$(PIP) install --constraint constraints.txt --editable '.[test]'
	@touch $@

demo: $(VENV)/installed
	$(BIN)/jaxphys generate "a strawberry" --material jelly --out outputs/demo --overwrite

test: $(VENV)/installed-test
	$(BIN)/python -m pytest -n auto --dist loadfile -m "not slow"

test-slow: $(VENV)/installed-test
	XLA_FLAGS="$$XLA_FLAGS" $(BIN)/python -m pytest -m slow

lint: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(VENV)/installed
	$(PIP) install --constraint constraints.txt --editable '.[docs,mesh]'
	$(BIN)/python -m sphinx --fail-on-warning --keep-going $(DOCS) -b html docs outputs/docs

bench: $(VENV)/installed-test
	$(PIP) install --constraint constraints.txt --editable '.[bench]'
	$(BIN)/python -m benchmarks run all --quick --out outputs/bench.jsonl

clean:
	rm -rf $(VENV) outputs
