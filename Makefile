# Everything sets itself up: a machine with Python 3.11 or newer, make and git is enough. `make` alone lists the targets.
PYTHON ?= python3
ARGS ?=
# How many tests run at once, of those that do not watch the clock: as many as there are processors, each with a gigabyte.
JOBS ?= $(shell n=$$(nproc 2>/dev/null || echo 2); [ $$n -gt 8 ] && n=8; echo $$n)
BIN := .venv/bin
MAKEFLAGS += --no-print-directory
.DEFAULT_GOAL := help
.PHONY: help demo test bench prove lint lock clean set-up set-up-dev python

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' Makefile

demo: set-up ## start the live system on the simulated box and print its address (ARGS="..." adds options)
	@exec $(BIN)/cathxr run $(ARGS)

test: set-up-dev ## linters, types, layers, the web client's tests, then pytest (ARGS="..." adds options)
	@sh tools/system_packages.sh
	@$(BIN)/python tools/compile_ahead.py & ahead=$$!; \
	  { $(MAKE) lint && $(BIN)/python tools/web_client.py test && wait $$ahead; } || { kill $$ahead 2>/dev/null; exit 1; }
	@$(BIN)/pytest -n $(JOBS) --dist loadgroup -m "not proof and not live" $(ARGS); pure=$$?; \
	  $(BIN)/pytest -m "live and not proof" $(ARGS); live=$$?; \
	  case $$pure$$live in 00|05|50) ;; *) exit 1 ;; esac # 5: none of that kind among those asked for

bench: set-up ## measure speed, latency and load; prints a table (ARGS="..." adds options)
	@exec $(BIN)/cathxr bench $(ARGS)

prove: set-up-dev ## the long proofs: minutes each
	@sh tools/system_packages.sh
	@exec $(BIN)/pytest -m proof -o faulthandler_timeout=3600 $(ARGS)

lint: set-up-dev ## ruff, mypy --strict and the layers of the architecture
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy --strict
	$(BIN)/lint-imports

lock: ## write the pinned versions again (UPGRADE=1: newest ones)
	@PYTHON=$(PYTHON) sh tools/lock.sh

clean: ## remove everything that these targets made, .venv included
	rm -rf .venv .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache build dist
	rm -rf src/cathxr/web_client web/node_modules web/dist
	find src tests tools -name __pycache__ -type d -prune -exec rm -rf {} +

set-up: python
	@$(PYTHON) tools/set_up.py

set-up-dev: python
	@$(PYTHON) tools/set_up.py --dev

python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "cathxr needs Python 3.11 or newer and $(PYTHON) is not: install one and name it, as in" \
	  "\`make PYTHON=python3.12 demo\`." >&2; exit 1; }
