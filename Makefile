# make sample   set up, run the whole pipeline on sample_data, print the tables
# make test     set up, check the code's form, run all tests
# make blind    hide effects in recordings and see whether `bsip diagnose` finds them (hours)
# make cohort   simulate twelve people with 120 s sequences and run them
PYTHON ?= python3
JOBS ?= 2
DRAWS ?= 10
BIN := .venv/bin

.PHONY: sample test blind cohort check clean

sample: .venv/ready
	$(BIN)/bsip run sample_data --out out/sample --jobs $(JOBS)
	$(BIN)/bsip show out/sample

test: check
	$(BIN)/pytest -n $(JOBS) --dist loadfile

blind: .venv/ready
	$(BIN)/python tests/blind/blind_long.py --jobs $(JOBS) --draws $(DRAWS)

check: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/mypy

cohort: .venv/ready
	test -d out/cohort_study || $(BIN)/bsip simulate out/cohort_study --preset cohort
	$(BIN)/bsip run out/cohort_study --out out/cohort --jobs $(JOBS)
	$(BIN)/bsip show out/cohort

.venv/ready: requirements.lock pyproject.toml
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'bsip needs Python 3.11 or later; name one with make PYTHON=...')"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	touch .venv/ready

clean:
	rm -rf .venv out
