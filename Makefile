# make sample   set up, run the whole pipeline on sample_data, print the tables
# make test     set up, check the code's form, run the tests of every part and a small run (minutes)
# make test-long   the other tests: whole runs, the short blind suite, real recordings, damaged files
# make coverage   the tests of `make test`, and which lines of the package they reach, by folder
# make blind    hide effects in recordings and see whether `bsip diagnose` finds them (hours)
# make cohort   simulate twelve people with 120 s sequences and run them
# make COHORT=path [OUT=path] [-j 4]   your study: so many participants at once, then the tables of
#               all; only what changed is done again, who fails is named and stops nobody
# make docs     the pages of docs/ as a site, in out/site
# make cluster COHORT=path [OUT=path] [PROFILE=slurm]   the same by Snakemake (workflow/README.md)
PYTHON ?= python3
JOBS ?= 2
DRAWS ?= 10
BIN ?= .venv/bin
READY ?= .venv/ready
COHORT ?=
PROFILE ?= plain
CLUSTER ?= .venv-cluster
DOCS ?= .venv-docs

.PHONY: sample test test-long coverage blind cohort check clean study cluster locks docs

sample: $(READY)
	$(BIN)/bsip run sample_data --out out/sample --jobs $(JOBS)
	$(BIN)/bsip show out/sample

# What the tests' many processes of bsip have in common is compiled once.
unexport PYTHONDONTWRITEBYTECODE
PYTEST = $(BIN)/pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder

test: check
	$(PYTEST) -m "not long"

test-long: $(READY)
	@$(MAKE) --no-print-directory $(CLUSTER)/ready || echo "Snakemake cannot be installed: its tests will skip"
	$(PYTEST) -m long

coverage: .venv/ready
	$(PYTEST) -m "not long" --cov --cov-report=json:out/coverage.json
	$(BIN)/python -m benchmarks.coverage out/coverage.json

blind: .venv/ready
	$(BIN)/python -m tests.blind.blind_long --jobs $(JOBS) --draws $(DRAWS)

check: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/mypy

cohort: .venv/ready
	test -d out/cohort_study || $(BIN)/bsip simulate out/cohort_study --preset cohort
	$(BIN)/bsip run out/cohort_study --out out/cohort --jobs $(JOBS)
	$(BIN)/bsip show out/cohort

docs: $(DOCS)/ready
	$(DOCS)/bin/mkdocs build --strict --quiet
	@echo out/site/index.html

# --- a study of your own --------------------------------------------------------------------------
# bsip itself knows what is up to date. Paths go through the environment: whatever stands in them, the
# shell takes each as one word. Bad data of some participants (exit code 3) are reported and no failure.

ifneq ($(value COHORT),)
.DEFAULT_GOAL := study
export BSIP_STUDY := $(value COHORT)
export BSIP_OUT := $(value OUT)
PLACES = study=$${BSIP_STUDY%/}; out=$${BSIP_OUT:-$${study}_results}
AT_ONCE = $(or $(patsubst -j%,%,$(filter -j%,$(MAKEFLAGS))),$(JOBS))
SHOWN = case $$code in 0|3) $(BIN)/bsip show "$$out";; *) exit $$code;; esac

study: $(READY)
	@$(PLACES); $(BIN)/bsip run "$$study" --out "$$out" --jobs $(AT_ONCE); code=$$?; $(SHOWN)

SNAKEMAKE = BSIP="$(abspath $(BIN))/bsip" BSIP_STUDY="$$study" BSIP_OUT="$$out" \
	$(CLUSTER)/bin/snakemake --snakefile workflow/Snakefile --profile workflow/profiles/$(PROFILE)

cluster: $(READY) $(CLUSTER)/ready
	@$(PLACES); $(SNAKEMAKE) -- everybody; failed=$$?; \
	$(BIN)/bsip run "$$study" --out "$$out" --group; code=$$?; $(SHOWN) && exit $$failed
endif

# --- setting up -----------------------------------------------------------------------------------

.venv/ready: requirements.lock pyproject.toml
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'bsip needs Python 3.11 or later; name one with make PYTHON=...')"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps --editable .
	touch .venv/ready

$(CLUSTER)/ready: requirements-cluster.lock
$(DOCS)/ready: requirements-docs.lock
$(CLUSTER)/ready $(DOCS)/ready:
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement $<
	touch $@

# All locks anew from pyproject.toml, with the versions that they have;
# make locks UPGRADE=--upgrade takes the newest that fit.
UV = uv==0.13.9
UPGRADE ?=
LOCK = --no-config --quiet pip compile --universal --python-version 3.11 --generate-hashes \
	--no-annotate --custom-compile-command "make locks" $(UPGRADE)
NEEDS = import sys, tomllib; \
	print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"][sys.argv[1]], sep="\n")

locks:
	@tool=$$(mktemp -d) && trap "rm -rf $$tool" EXIT && $(PYTHON) -m venv $$tool && \
	$$tool/bin/python -m pip install --quiet --disable-pip-version-check $(UV) && \
	$$tool/bin/uv $(LOCK) pyproject.toml --extra dev --output-file requirements.lock && \
	for extra in cluster docs; do \
		$(PYTHON) -c '$(NEEDS)' $$extra > $$tool/$$extra.in && \
		$$tool/bin/uv $(LOCK) $$tool/$$extra.in --output-file requirements-$$extra.lock || exit 1; \
	done

clean:
	rm -rf .venv $(CLUSTER) $(DOCS) out
