# make study   run the user-study replication (preset fast) and open its report's path
# make test    run the tests
# make check   lint, format check, types, layering
# make format  format the code
# make clean   remove what make made

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PRESET ?= fast
OUT ?= study
INSTALLED := $(VENV)/.installed

.PHONY: study test check format bench clean

study: $(INSTALLED)
	$(BIN)/polite replicate --preset $(PRESET) --out $(OUT) --resume

test: $(INSTALLED)
	$(BIN)/python -m pytest

bench: $(INSTALLED)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only

check: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(INSTALLED)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	touch $@

clean:
	rm -rf $(VENV) $(OUT) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
