# Commands for people; .ci/run calls the same ones.
#
#   make demo         from nothing to pictures of a fitted, half-hidden person
#   make test         the whole test suite
#   make check        ruff and mypy
#   make bench-gate   accuracy and speed on a few scenes against the committed baseline
#   make messages     the ROS messages of msg_defs, and those of other packages that tests need,
#                     without ROS (needs g++ and python3-dev)
#   make viz          add the rerun SDK (200 MB), for `--rerun` and its test
#   make train        add PyTorch (1 GB), for `python -m pop_core.training` and its tests
#   make docs         write the generated pages of docs/ anew
#   make pictures     draw the pictures of docs/ anew (that of rviz needs ROS 1)
#
# Needs Python 3.10 to 3.13 with venv, and make. Choose another Python with PYTHON=, another place
# for the environment with VENV=. What is downloaded goes into that environment only.

PYTHON ?= python3
VENV ?= .venv
DEMO ?= demo_output
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
TEST_MESSAGES := tf2_msgs hri_msgs zed_msgs vision_msgs yolo_msgs
COMPUTED := test/core test/benchmarks test/docs
SOURCES := $(shell find pop_core pop_ros -type f -not -name '*.pyc') setup.py package.xml

.PHONY: demo test check bench-gate messages train viz docs pictures clean
.DELETE_ON_ERROR:

demo: $(VENV)/.installed
	cd / && $(abspath $(BIN))/pop demo --out $(abspath $(DEMO))

# Tests of computation share two processes; those of nodes, bags and pictures want the machine for
# themselves.
test: $(VENV)/.tools
	failed=0; \
	$(BIN)/python -m pytest -n 2 --dist loadfile $(COMPUTED) || failed=1; \
	$(BIN)/python -m pytest $(addprefix --ignore=,$(COMPUTED)) test || failed=1; \
	exit $$failed

check: $(VENV)/.tools
	$(BIN)/python -m ruff check .
	$(BIN)/python -m mypy

bench-gate: $(VENV)/.tools
	$(BIN)/python -m benchmarks gate

messages: $(BIN)/python
	scripts/build_messages.sh build/pop_msgs $(BIN)/python
	set -e; for package in $(TEST_MESSAGES); do \
	  POP_MESSAGE_TOOLS=$(abspath build/pop_msgs/tools) \
	    scripts/build_messages.sh build/$$package $(BIN)/python test/support/$$package; done

train: $(VENV)/.tools
	$(PIP) install --quiet --constraint constraints.txt --no-build-isolation '.[train]'

viz: $(VENV)/.tools
	$(PIP) install --quiet --constraint constraints.txt 'rerun-sdk>=0.23'

docs: $(VENV)/.tools
	$(BIN)/python -m scripts.write_docs

pictures: $(VENV)/.tools
	$(BIN)/python -m scripts.write_pictures docs/pictures
	$(BIN)/python -m scripts.write_gallery docs/pictures
	$(BIN)/python -m scripts.write_rviz_picture docs/pictures
	$(BIN)/python -m scripts.write_interop_picture docs/pictures

clean:
	rm -rf build dist *.egg-info $(DEMO)

# An existing environment is used as it is and only added to.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 10) <= sys.version_info < (3, 14))' || \
	  { echo 'pop needs Python 3.10 to 3.13, found: '"$$($(PYTHON) --version 2>&1)"; \
	    echo 'Name another one: make PYTHON=python3.12 ...'; exit 1; }
	@$(PYTHON) -c 'import venv, ensurepip' 2>/dev/null || \
	  { echo 'pop needs the venv module of Python: sudo apt-get install python3-venv'; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.tools: setup.py constraints.txt | $(BIN)/python
	@echo 'Installing the libraries into $(VENV) (about 1 GB, once)'
	$(PIP) install --quiet --constraint constraints.txt setuptools wheel
	$(PIP) install --quiet --constraint constraints.txt --no-build-isolation '.[test]'
	touch $@

# Not editable: an editable install leaves out what ROS looks for below share/.
$(VENV)/.installed: $(VENV)/.tools $(SOURCES)
	rm -rf build/lib build/bdist.*  # modules deleted since the last build would come along
	$(PIP) install --quiet --no-deps --no-build-isolation --force-reinstall .
	touch $@
