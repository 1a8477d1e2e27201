# `make demo` and `make test` need no preparation: each sets up .venv by itself.
PYTHON ?= python3
BUILD ?= build/colcon

VENV := .venv
LINT := .venv-lint
COLCON := .venv-colcon
ASV := .venv-asv
DOCS := .venv-docs
SAMPLE ?= 0
COMMITS ?= HEAD^!
QUICK ?=
VIEW ?=
# Whose rclpy .venv takes from PyPI where no ROS is sourced: jazzy or kilted.
ROS_WHEELS ?= jazzy
ifeq ($(findstring [$(ROS_WHEELS)],[jazzy] [kilted]),)
$(error ROS_WHEELS is '$(ROS_WHEELS)', but PyPI has rclpy of jazzy and kilted: 'make ROS_WHEELS=kilted $(MAKECMDGOALS)')
endif
COUNTED := $(VENV)/bin/python -m pytest --cov --cov-append --cov-report=
# A sourced ROS brings its own rclpy. The .venv differs with whose rclpy it has, so the stamps differ too.
READY := $(VENV)/.ready-$(if $(AMENT_PREFIX_PATH),ros-$(ROS_DISTRO),pypi-$(ROS_WHEELS))

.PHONY: help venv demo test coverage mutation fuzz nightly bench bench-history bench-node report docs site lint build clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/make \1\t\2/p' $(MAKEFILE_LIST)

demo: $(READY) ## run the demo (VIEW=1: show it in the browser, until Ctrl-C)
	@$(VENV)/bin/rigid_body_demo $(if $(VIEW),--view)

test: $(READY) ## run all tests, those with ROS file by file, those marked no_numba again without numba
	$(VENV)/bin/python -m pytest -n 2 -m "not ros and not nightly"
	$(VENV)/bin/python -m pytest -n 2 --dist loadfile -m "ros and not nightly"
	RIGID_BODY_SIM_NO_NUMBA=1 $(VENV)/bin/python -m pytest -n 2 -m "no_numba and not nightly"

coverage: $(READY) ## run all tests, count the lines that they reach, and fail where these are too few
	rm -f .coverage .coverage.*
	RIGID_BODY_SIM_NO_NUMBA=1 $(COUNTED) -n 2 -m "no_numba and not nightly"
	$(COUNTED) -n 2 -m "not ros and not nightly"
	$(COUNTED) -n 2 --dist loadfile -m "ros and not nightly"
	$(VENV)/bin/coverage report --include '*/kernels/*,*/values/*,*/mass/*,*/effects/*,*/theory/*,*/integrators/*,*/scene/*' --fail-under 95
	$(VENV)/bin/coverage report --fail-under 90

mutation: $(READY) ## change the physics in small ways and list the changes that no test notices (hours; SAMPLE=20)
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check cosmic-ray
	$(VENV)/bin/python .ci/mutation --sample $(SAMPLE)

fuzz: $(READY) ## try a million hostile inputs, about half an hour on 2 cores
	$(VENV)/bin/python -m pytest -n 2 --dist worksteal test/fuzz --hypothesis-profile=nightly --timeout=7200
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --only-binary :all: atheris
	$(VENV)/bin/python test/fuzz/guided.py

nightly: fuzz ## make fuzz, long faults and long runs, more than an hour
	$(VENV)/bin/python -m pytest -m nightly -s --timeout=7200

bench: $(READY) ## measure what a step costs
	@$(VENV)/bin/python -m bench.step_cost
	@$(VENV)/bin/python -m bench.plan_cost
	@$(VENV)/bin/python -m bench.stiff_cost
	@$(VENV)/bin/python -m bench.actuator_cost

# asv describes a machine once, in the home folder, and compares only what one machine has measured.
bench-history: $(ASV)/.ready ## measure COMMITS=OLD..NEW, else the last one, with asv, and write pages of all (QUICK=1: each once)
	@git rev-list --quiet '$(COMMITS)' -- || { \
		echo "COMMITS is '$(COMMITS)', but must be a range that git knows, such as 'v1.0..HEAD' or 'HEAD^!'." >&2; exit 1; }
	@[ -e ~/.asv-machine.json ] || $(ASV)/bin/asv machine --yes --config bench/asv/asv.conf.json
	$(ASV)/bin/asv run --config bench/asv/asv.conf.json --show-stderr $(if $(QUICK),--quick) '$(COMMITS)'
	$(ASV)/bin/asv publish --config bench/asv/asv.conf.json

bench-node: $(READY) ## measure the node as a process over DDS, about 10 minutes
	@$(VENV)/bin/python -m bench.node_bench

report: $(READY) ## measure error against run time and draw it, into rigid_body_report/ (under 20 minutes)
	@$(VENV)/bin/rigid_body_report

docs: $(READY) ## write the tables in docs/ anew from the code
	@$(VENV)/bin/python -m bench.doc_tables

site: $(DOCS)/.ready ## build docs/ and the Python reference as web pages, into build/site
	$(DOCS)/bin/sphinx-build -W --keep-going -E -a -q -b html -d build/site-cache docs build/site

lint: $(LINT)/.ready ## check format, style, types, spelling, YAML and XML
	$(LINT)/bin/ruff format --check .
	$(LINT)/bin/ruff check .
	$(LINT)/bin/mypy
	$(LINT)/bin/codespell
	$(LINT)/bin/check-yaml .pre-commit-config.yaml CITATION.cff $(wildcard config/*.yaml .github/*.yml .github/*/*.yml)
	$(LINT)/bin/check-xml package.xml $(wildcard config/*.xml launch/*.xml security/*.xml)

build: $(COLCON)/.ready ## build with colcon, into build/colcon
	$(COLCON)/bin/colcon --log-base $(BUILD)/log build --base-paths . --packages-select rigid_body_sim \
		--build-base $(BUILD)/build --install-base $(BUILD)/install

venv: $(READY) ## set up .venv

clean: ## remove everything that make made
	rm -rf $(VENV) $(LINT) $(COLCON) $(ASV) $(DOCS) build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache .hypothesis .coverage*
	rm -rf rigid_body_demo.png rigid_body_report
	find rigid_body_sim bench test -name __pycache__ -prune -exec rm -rf {} +

define check_python
$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info[:2] <= (3, 13))' 2>/dev/null || { \
	version=$$($(PYTHON) --version 2>&1) || version="not found"; \
	echo "'$(PYTHON)' is $$version, but Python 3.10 to 3.13 is needed: name one with 'make PYTHON=python3.12 $(MAKECMDGOALS)'." >&2; \
	exit 1; }; \
$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	echo "'$(PYTHON)' lacks its venv module: install it (on Debian and Ubuntu 'sudo apt install python3-venv')." >&2; \
	exit 1; }
endef

# An interrupted set-up leaves no stamp and starts afresh; a changed setup.py updates the .venv that is there.
$(READY): setup.py setup.cfg pyproject.toml
	@$(check_python)
	@echo "Setting up $(VENV) (once, about a minute) ..."
	@set -e; \
	extras=ros-$(ROS_WHEELS),fast,report,test; site=; \
	if $(PYTHON) -c 'import rclpy' 2>/dev/null; then \
		case "$$ROS_DISTRO" in \
		jazzy|kilted) echo "Using rclpy of the sourced ROS $$ROS_DISTRO."; extras=fast,report,test; site=--system-site-packages ;; \
		?*) echo "ROS $$ROS_DISTRO is sourced, but Jazzy or Kilted is needed: source one, or use a shell with no ROS sourced." >&2; \
			exit 1 ;; \
		esac; \
	fi; \
	[ -e $@ ] || $(PYTHON) -m venv --clear $$site $(VENV); \
	$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --upgrade pip; \
	PYTHONWARNINGS="ignore:Editable installation" \
		$(VENV)/bin/python -m pip install --quiet --disable-pip-version-check --editable ".[$$extras]"; \
	$(VENV)/bin/python -c 'import rclpy, geometry_msgs.msg' || { \
		echo "rclpy does not work in $(VENV), see above. A ROS made for another Python may be sourced: use a shell without it." >&2; \
		exit 1; }; \
	touch $@

$(LINT)/.ready: .pre-commit-config.yaml
	@$(check_python)
	@echo "Setting up $(LINT) (once) ..."
	@$(PYTHON) -m venv --clear $(LINT)
	@$(LINT)/bin/python -m pip install --quiet --disable-pip-version-check \
		$$(grep -o '[a-z-]*\(\[[a-z]*\]\)\?==[0-9.]*' .pre-commit-config.yaml | sort -u)
	@touch $@

$(DOCS)/.ready: docs/requirements.txt
	@$(check_python)
	@echo "Setting up $(DOCS) (once) ..."
	@$(PYTHON) -m venv --clear $(DOCS)
	@$(DOCS)/bin/python -m pip install --quiet --disable-pip-version-check -r docs/requirements.txt
	@touch $@

# setuptools is named because a new venv no longer has it, and colcon runs setup.py with it.
$(COLCON)/.ready:
	@$(check_python)
	@echo "Setting up $(COLCON) (once) ..."
	@$(PYTHON) -m venv --clear $(COLCON)
	@$(COLCON)/bin/python -m pip install --quiet --disable-pip-version-check setuptools colcon-common-extensions
	@touch $@

$(ASV)/.ready:
	@$(check_python)
	@echo "Setting up $(ASV) (once) ..."
	@$(PYTHON) -m venv --clear $(ASV)
	@$(ASV)/bin/python -m pip install --quiet --disable-pip-version-check asv virtualenv
	@touch $@
