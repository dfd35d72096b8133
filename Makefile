# make study   run the user-study replication (preset fast) and open its report's path
# make test    run the tests
# make bench   measure speeds, peers included
# make check   lint, format check, types, layering
# make format  format the code
# make clean   remove what make made

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PRESET ?= fast
OUT ?= study
INSTALLED := $(VENV)/.installed
PUSHT := .venv-pusht
IMITATION := .venv-imitation

.PHONY: study test check format bench clean

study: $(INSTALLED)
	$(BIN)/polite replicate --preset $(PRESET) --out $(OUT) --resume

test: $(INSTALLED)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -n auto --dist worksteal

bench: $(INSTALLED) $(PUSHT)/.installed $(IMITATION)/.installed
	$(BIN)/python -m pytest tests/benchmarks tests/polite/study/test_kill.py --benchmark-only

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

# A peer that needs an older pymunk, for the speed comparison only.
$(PUSHT)/.installed:
	$(PYTHON) -m venv $(PUSHT)
	$(PUSHT)/bin/python -m pip install --quiet 'gym-pusht==0.1.8' 'pymunk<7'
	touch $@

# A peer that needs an older Gymnasium, MuJoCo and NumPy; measured with our own PyTorch's version.
$(IMITATION)/.installed:
	$(PYTHON) -m venv $(IMITATION)
	$(IMITATION)/bin/python -m pip install --quiet 'imitation==1.0.1' 'gymnasium[mujoco]==0.29.1' \
		'mujoco<3' 'numpy<2' 'setuptools<81' "$$(grep '^torch==' constraints.txt)"
	touch $@

clean:
	rm -rf $(VENV) $(PUSHT) $(IMITATION) $(OUT) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
