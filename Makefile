# Everything sets itself up: `make demo` and `make test` work in a fresh clone.
#
# On Debian and its relatives a bare machine lacks two packages: make and python3-venv.

PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PACKAGES := $(wildcard ddsi tests multiproc_tests examples benchmarks)
TYPED := $(PACKAGES) typings/ddsi_security

# A test file stays in one worker, as what its tests share is made once.
IN_PARALLEL := -n auto --dist loadfile
# Real processes, each scenario in namespaces of its own: three at a time, as they mostly wait, and late ones are failures.
THREE_AT_A_TIME := -n 3

# Tests and the demo stay on this host, whatever the machine is connected to.
export DDSI_URI := <DDSI><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General></Domain></DDSI>
export CYCLONEDDS_URI := <CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces></General></Domain></CycloneDDS>
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# The tests start hundreds of Pythons: each would compile everything anew.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo test quick lint format interop fuzz bench clean

help:  ## Say what can be made
	@grep -hE '^[a-z]+:.*##' Makefile | sed -E 's/^([a-z]+):.*## */  make \1\t/' | expand -t 18

demo: $(VENV)/.ready-to-run  ## Live data between processes, under a minute
	$(BIN)/ddsi demo

test: $(VENV)/.ready-to-test $(VENV)/.ready-with-peers $(VENV)/.ready-to-lint  ## All tests; those with other stacks where these are installed
	$(BIN)/python -m pytest $(IN_PARALLEL) $(wildcard tests) $(ARGS)
	$(BIN)/python -m pytest $(THREE_AT_A_TIME) -m "not alone" $(wildcard multiproc_tests) $(ARGS)
	$(BIN)/python -m pytest -m alone $(wildcard multiproc_tests) $(ARGS)

quick: $(VENV)/.ready-to-test  ## The tests that take milliseconds, without other processes
	$(BIN)/python -m pytest $(IN_PARALLEL) -m "not slow and not peers" tests $(ARGS)

lint: $(VENV)/.ready-to-lint  ## ruff, mypy, pyright
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy $(TYPED)
	$(BIN)/pyright

format: $(VENV)/.ready-to-lint  ## Let ruff lay out the code
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

interop: $(VENV)/.ready-to-test $(VENV)/.ready-with-peers  ## Every case with every peer; writes docs/interop
	$(BIN)/python -m multiproc_tests.interop $(ARGS)
	$(if $(ARGS),,$(BIN)/python -m multiproc_tests.omg)

fuzz: $(VENV)/.ready-to-fuzz  ## Coverage-guided, one TARGET for SECONDS; without a TARGET, all in turn
	$(BIN)/python -m tests.fuzz $(or $(TARGET),all) $(or $(SECONDS),60)

bench: $(VENV)/.ready-to-test $(VENV)/.ready-with-peers  ## Beside the C-backed binding, as ratios
	$(BIN)/python -m benchmarks $(ARGS)

clean:  ## Remove what was made, the virtual environment too
	rm -rf $(VENV) build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .fuzz
	find $(PACKAGES) security -name __pycache__ -type d -prune -exec rm -rf {} +

# An editable install finds the packages by a hook, which type checkers and editors do not run.  They do read .pth files.
define NAME_THE_SOURCES
import pathlib, sysconfig
here = pathlib.Path.cwd()
pathlib.Path(sysconfig.get_path('purelib'), 'ddsi-sources.pth').write_text(f'{here}\n{here / "typings"}\n')
endef
export NAME_THE_SOURCES

# --- the virtual environment: each stamp file stands for what is installed in it ---

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo >&2 "ddsi needs Python 3.11 or later, and '$(PYTHON)' is not: install the Debian package python3," \
	           "or say which to use: make PYTHON=python3.12"; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || { \
	  echo >&2 "'$(PYTHON)' cannot make virtual environments: install the Debian package python3-venv" \
	           "(apt-get install python3-venv)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	@touch $@

$(VENV)/.ready-to-run: $(VENV)/.made pyproject.toml
	$(BIN)/python -m pip install --quiet -e '.[all]'
	@$(BIN)/python -c "$$NAME_THE_SOURCES"
	@touch $@

$(VENV)/.ready-to-test: $(VENV)/.ready-to-run pyproject.toml
	$(BIN)/python -m pip install --quiet --group test
	@touch $@

$(VENV)/.ready-to-lint: $(VENV)/.ready-to-test pyproject.toml
	$(BIN)/python -m pip install --quiet --group lint
	@touch $@

$(VENV)/.ready-to-fuzz: $(VENV)/.ready-to-test pyproject.toml
	$(BIN)/python -m pip install --quiet --group fuzz
	@touch $@

# There are no wheels of the peers for every platform, so doing without them is an error only where they are required.
$(VENV)/.ready-with-peers: $(VENV)/.ready-to-run pyproject.toml
	@echo '$(BIN)/python -m pip install --quiet --group peers'
	@if $(BIN)/python -m pip install --quiet --group peers; then touch $@; \
	elif test -n "$(DDSI_REQUIRE_PEERS)"; then exit 1; \
	else echo >&2 "The peers from PyPI cannot be installed here; the tests that need them are skipped."; fi
