# SPDX-License-Identifier: Apache-2.0
# All output is inside this folder: .venv/ (Python environment), build/ (compiler output), and the files of the demo.
SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

PYTHON      ?=
VENV        ?= .venv
JOBS        ?= $(shell nproc)
EXTRAS      ?= test lint interop
PYTEST_ARGS ?=
# Python tests wait for timers and messages half of the time, so one more than there are cores. At most 8, because each
# starts its own nodes.
TEST_JOBS   ?= $(shell echo $$(($(JOBS) < 8 ? $(JOBS) + 1 : 8)))
AARCH64_TESTS ?= *
DEMO_ARGS   ?=
HPCCD_CUDA  ?= AUTO
FUZZ_ARGS   ?= --seconds 60
BENCH_ARGS  ?= --help

BIN := $(VENV)/bin
export PATH := $(abspath $(BIN)):$(PATH)
export CMAKE_BUILD_PARALLEL_LEVEL := $(JOBS)
# Build tree of the package, the C++ tests and the C++ library: one for each environment.
TREE := build/cmake$(if $(filter-out .venv,$(VENV)),-$(notdir $(VENV)))
export HPCCD_BUILD_TREE := $(abspath $(TREE))
export PIP_DISABLE_PIP_VERSION_CHECK := 1
# The bootstrapper of the ROS wheels marks its environment; unset the mark of another one.
unexport PYTHONPATH PYTHONHOME _ROS_WHEELS_BOOTSTRAP_COMPLETE
# A ROS installation sourced in this shell must not mix with the wheels, which contain one RMW implementation only.
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH RMW_IMPLEMENTATION
ifdef ROS_DISTRO
unexport LD_LIBRARY_PATH
endif

# Stamps. PYTHON or EXTRAS from the command line have their own, so that a change of them is noticed.
space := $(subst ,, )
ENVIRONMENT := $(VENV)/.hpccd-environment$(if $(PYTHON),-$(subst /,-,$(PYTHON)))$(if \
  $(filter-out file,$(origin EXTRAS)),-$(subst $(space),+,$(EXTRAS)))
COUNTED     := build/venv-coverage
INSTALLED   := $(VENV)/.hpccd-installed
LIST        := $(TREE)-sources.txt

# Sources of the installed package.
SOURCES := $(sort $(shell find CMakeLists.txt setup.py package.xml action cmake config launch msg srv scripts hpccd_ros hpccd_core \
  \( -name __pycache__ -o -name dist -o -path hpccd_core/tests \) -prune -o -type f -print))

.PHONY: help venv demo bench test test-core test-python test-long test-gpu test-aarch64 sanitize coverage measure-coverage fuzz fuzz-bytes oracle docs lint format release-check pin clean distclean \
  FORCE

help: ## Show this list of targets
	@echo "hpccd: continuous collision detection of deforming triangle meshes, as a ROS 2 node."
	@echo "New here? make demo"
	@echo
	@awk -F ':.*## ' '/^[a-z0-9-]+:.*## / { printf "  make %-13s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
	@echo
	@echo "Variables, e.g. make test PYTEST_ARGS='-k replay':"
	@echo "  PYTHON=python3.12   Python of .venv: 3.11 or 3.12 (default: the first found)"
	@echo "  VENV=.venv          folder of the environment"
	@echo "  JOBS=4              compile jobs (default: all cores)"
	@echo "  HPCCD_CUDA=ON       compile the GPU backends (default: if there is an NVIDIA GPU); OFF: do not"
	@echo "  CMAKE_ARGS=...      arguments for CMake"
	@echo "  TEST_JOBS=1         parallel Python tests (default: one more than JOBS, at most 8)"
	@echo "  PYTEST_ARGS=...     arguments for pytest     DEMO_ARGS=...  arguments for hpccd demo"
	@echo "  AARCH64_TESTS='GoldenHashes.*'   tests of test-aarch64 (default: all)"
	@echo "  HPCCD_DATA=folder   scenes with ground truth (default: tests that need them are skipped)"

venv: $(INSTALLED) ## Create .venv, build and install the package; run again after a change

demo: venv ## Run node, publisher and recorder over DDS; write a recording and a picture
	@$(BIN)/hpccd demo $(DEMO_ARGS)

test: test-core test-python ## Run all tests

test-core: $(if $(wildcard $(TREE)/build.ninja),$(ENVIRONMENT),venv) ## Run the C++ tests
	@. $(VENV)/build.env; flock $(VENV) cmake --build $(TREE) --target hpccd_core_tests
	@CUDA_VISIBLE_DEVICES= ctest --test-dir $(TREE)/hpccd_core --output-on-failure --no-tests=error --parallel $(JOBS)

test-python: venv oracle ## Run the Python tests: core against oracles, node over DDS, recordings
	$(BIN)/pytest --numprocesses $(TEST_JOBS) --dist worksteal $(PYTEST_ARGS)

test-long: venv oracle ## Run the Python tests that take minutes, which make test skips
	$(BIN)/pytest --long -m long --numprocesses $(TEST_JOBS) $(PYTEST_ARGS)

test-gpu: venv oracle ## Run the tests of the GPU backends, on a machine with an NVIDIA GPU
	@$(BIN)/python -c 'import sys, hpccd_core as hc; "gpu" in hc.backends() or sys.exit(sys.argv[1])' \
	  "hpccd: no GPU backend here (see hpccd info). Without a CUDA toolkit: make venv EXTRAS='test cuda'"
	$(BIN)/pytest test/gpu $(PYTEST_ARGS)

test-aarch64: $(ENVIRONMENT) ## Run the C++ tests for aarch64 in an emulator (g++-aarch64-linux-gnu, qemu-user)
	@bash scripts/test_aarch64.sh $(VENV) '$(AARCH64_TESTS)'

sanitize: $(ENVIRONMENT) ## Run the C++ tests under AddressSanitizer and UBSan, then ThreadSanitizer
	@$(call run_core_tests,build/core-asan,-DCMAKE_BUILD_TYPE=RelWithDebInfo -DHPCCD_SANITIZE=address$(comma)undefined)
	@$(call run_core_tests,build/core-tsan,-DCMAKE_BUILD_TYPE=RelWithDebInfo -DHPCCD_SANITIZE=thread)

coverage: ## Run all tests in a second environment that counts lines; write build/coverage
	@$(MAKE) --no-print-directory VENV=$(COUNTED) EXTRAS="$(EXTRAS) coverage" HPCCD_CUDA=OFF \
	  CMAKE_ARGS="$(CMAKE_ARGS) -DHPCCD_COVERAGE=ON" measure-coverage

measure-coverage: venv oracle
	@. $(VENV)/build.env; cmake --build $(TREE) --target hpccd_core_tests
	$(BIN)/python scripts/measure_coverage.py --tree $(TREE) --jobs $(JOBS) -- --numprocesses $(TEST_JOBS) $(PYTEST_ARGS)

bench: venv oracle ## Run one benchmark (BENCH_ARGS="scaling"; by default, list them)
	PYTHONPATH=test $(BIN)/python -m bench $(BENCH_ARGS)

fuzz: venv oracle ## Compare the core with the exact oracle on random and degenerate queries (FUZZ_ARGS=--help)
	PYTHONPATH=test:build/oracle $(BIN)/python -m fuzz $(FUZZ_ARGS)

fuzz-bytes: venv $(VENV)/.hpccd-fuzz ## Fuzz what reads messages, recordings and files, by coverage (FUZZ_ARGS=--help)
	PYTHONPATH=test:test/support $(BIN)/python -m fuzz_bytes $(FUZZ_ARGS)

# Atheris and Sphinx are not part of the environment: make demo would install them for nothing.
$(VENV)/.hpccd-fuzz: $(ENVIRONMENT)
	@bash scripts/create_venv.sh $(VENV) $(EXTRAS) fuzz
	@touch $@

docs: $(INSTALLED) $(VENV)/.hpccd-docs ## Build the documentation as a site in build/site
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet --jobs $(JOBS) docs build/site
	@echo "hpccd: open build/site/index.html"

$(VENV)/.hpccd-docs: $(ENVIRONMENT)
	@bash scripts/create_venv.sh $(VENV) $(EXTRAS) docs
	@touch $@

oracle: $(ENVIRONMENT) ## Build the exact oracles for tests and fuzzer
	@mkdir -p build; . $(VENV)/build.env; { cmake -S test/oracle -B build/oracle -G Ninja \
	  -DPython_EXECUTABLE="$(abspath $(BIN))/python" && cmake --build build/oracle; } > build/oracle.log 2>&1 || { cat build/oracle.log; exit 1; }

lint: $(ENVIRONMENT) ## Check style, types, layers and commit subjects: ruff, mypy, import-linter, clang-format
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo --cache-dir build/import-linter
	$(BIN)/python scripts/check_includes.py
	@git ls-files -z '*.h' '*.cpp' '*.inl' '*.cu' '*.cuh' | xargs -0r $(BIN)/clang-format --dry-run --Werror
	@git log --since=2026-11-27T08:30Z --format='%h%x09%s' | awk -F'\t' 'length($$2) > 72 { \
	  print "commit " $$1 ": the subject \"" $$2 "\" has more than 72 characters; shorten it"; long = 1 } END { exit long }'

format: $(ENVIRONMENT) ## Fix the style where a tool can
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	@git ls-files -z '*.h' '*.cpp' '*.inl' '*.cu' '*.cuh' | xargs -0r $(BIN)/clang-format -i

release-check: $(ENVIRONMENT) ## List what a release still needs: addresses, dates, versions
	@$(BIN)/python scripts/release_check.py

pin: $(ENVIRONMENT) ## Write the versions installed in .venv to requirements/
	@version=$$($(BIN)/python -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
	  $(BIN)/python scripts/pin.py > requirements/constraints-$$version.txt

clean: ## Remove compiler output and caches; keep .venv
	rm -rf build dist hpccd.egg-info .pytest_cache .ruff_cache .hypothesis
	find . -path ./$(VENV) -prune -o -name __pycache__ -prune -exec rm -rf {} +

distclean: clean ## Remove .venv too
	rm -rf $(VENV)

comma := ,
# By default UBSan reports undefined behaviour and continues.
export UBSAN_OPTIONS := halt_on_error=1:print_stacktrace=1

# GoogleTest is source code in a wheel, so the tests need no system package and use the same version everywhere.
GTEST := -DHPCCD_BUILD_TESTS=ON -DGTest_DIR=$(CURDIR)/cmake/gtest -DHPCCD_GTEST_SOURCE=$(abspath $(VENV))/src/gtest_vendor

# Tests with other compiler flags than the package, in a separate build tree.
define run_core_tests
mkdir -p build; . $(VENV)/build.env; \
cmake -S hpccd_core -B $(1) -G Ninja $(GTEST) -DHPCCD_CUDA=OFF \
  -DPython3_EXECUTABLE="$(abspath $(BIN))/python" -DPython_EXECUTABLE="$(abspath $(BIN))/python" $(2) $${CMAKE_ARGS:-} > $(1).log 2>&1 || { cat $(1).log; exit 1; }; \
cmake --build $(1) --target hpccd_core_tests && ctest --test-dir $(1) --output-on-failure --no-tests=error
endef

$(ENVIRONMENT): pyproject.toml scripts/create_venv.sh scripts/requirements.py $(wildcard requirements/*.txt)
	@PYTHON="$(PYTHON)" bash scripts/create_venv.sh $(VENV) $(EXTRAS)
	@touch $@

$(INSTALLED): $(ENVIRONMENT) $(SOURCES) $(LIST)
	@echo "hpccd: building, and installing into $(VENV) (several minutes the first time)"
	@. $(VENV)/build.env; tests=; if [ -d $(VENV)/src/gtest_vendor ]; then tests='$(GTEST)'; fi; \
	  CMAKE_ARGS="-DHPCCD_CUDA=$(HPCCD_CUDA) $$tests $${CMAKE_ARGS:-}" \
	  flock $(VENV) $(BIN)/python -m pip install --quiet --no-build-isolation --no-deps .
	@cat $(TREE)/hpccd_core/cuda.txt
	@touch $@

# Changes when a source file is added or removed, or when options of CMake change.
$(LIST): FORCE
	@mkdir -p $(@D)
	@printf '%s\n' '$(HPCCD_CUDA) $(CMAKE_ARGS)' $(SOURCES) | cmp -s - $@ || \
	  printf '%s\n' '$(HPCCD_CUDA) $(CMAKE_ARGS)' $(SOURCES) > $@
FORCE:
