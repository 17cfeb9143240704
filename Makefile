# make demo, make test and make check set everything up by themselves; a second run installs nothing.
SHELL := /bin/bash
PYTHON ?= python3.11
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
SOAK ?=
# CPU builds of torch; empty for the usual index, whose torch for Linux comes with CUDA.
TORCH_INDEX ?= https://download.pytorch.org/whl/cpu
export TORCH_INDEX
APT_PACKAGES := libusb-1.0-0 libgl1 libegl1 libx11-6 libudev1 libidn2-0 libgomp1

# What a newer Python could change: compiled kernels, plants without bullet, drives, learning, types
# of settings, files, and the command line.
NEWER_TESTS := tests/terrain tests/rl tests/andabata/machine \
	tests/andabata/assembly tests/andabata/configuration tests/andabata/runs tests/test_journey.py \
	tests/andabata/test_engine.py tests/andabata/test_engine_processes.py \
	tests/andabata/app/doctor tests/andabata/app/test_cli.py tests/andabata/app/test_driven_plant.py

ROS_PACKAGES := ros-core python3-rospy python3-rosbag python3-geometry-msgs python3-nav-msgs \
	python3-sensor-msgs python3-diagnostic-msgs python3-tf

.PHONY: demo test check bench soak peers clean install newer-python wheel ros ros2 browser docs \
	gallery

demo: install
	$(BIN)/andabata demo

test: install
	$(BIN)/python -m pytest -n 2 --dist worksteal -q tests

check: install
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

# The tests that a newer Python could fail, in an environment of its own: Python 3.13 or 3.12, without
# bullet. Minutes.
newer-python:
	@APT_PACKAGES="$(APT_PACKAGES)" bash .ci/newer_python.sh build/newer-python $(NEWER_TESTS)

# The wheel that others install, in dist.
wheel: install
	$(BIN)/python -m hatchling build --target wheel --directory dist

bench: peers
	$(BIN)/andabata bench
	$(BIN)/andabata bench chain
	$(BIN)/python -m andabata.bench.studies.vehicle_rates
	$(BIN)/python -m andabata.bench.studies.maze andabata/models/policy.safetensors
	$(BIN)/python -m andabata.bench.studies.planar
	$(BIN)/andabata clouds generate --out data/clouds/bench --seed 200 --train 140 --validation 140
	$(BIN)/andabata bench perception --clouds data/clouds/bench
	$(BIN)/python -m andabata.bench.studies.scan data/clouds/bench
	$(BIN)/python -m andabata.bench.studies.live

# Checks what docs/reliability.md promises, with a table at its end, and fails where it does not hold:
# some hours; make soak SOAK="--minutes 10" is the short version. Fails, too, when a stage of the
# control loop has become slower by more than half.
soak: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[fuzz]' || true
	$(BIN)/python -m andabata.bench.studies.soak $(SOAK)
	$(BIN)/python -m andabata.bench.chain_check

install: $(STAMP)

$(STAMP): pyproject.toml constraints.txt .ci/setup.sh
	@APT_PACKAGES="$(APT_PACKAGES)" bash .ci/setup.sh "$(PYTHON)" "$(VENV)"
	@touch $@

# Debian's ROS 1, for the live graph and its tests; nothing else needs it.
ros:
	@bash .ci/apt.sh $(ROS_PACKAGES)

# ROS 2's own client with Fast DDS in an environment of its own, for the tests of the live graph.
ros2:
	@bash .ci/rclpy.sh "$(PYTHON)" build/rclpy

# Debian's Chromium, for the tests of the live view and of the reports; nothing else needs it.
browser:
	@bash .ci/apt.sh chromium

# The documents as a site in build/docs; nothing is fetched when it is viewed.
docs: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[docs]'
	$(BIN)/zensical build --strict

# The pictures of the documents, by the commands in docs/gallery.md; takes ten minutes.
gallery: install
	$(BIN)/python -m andabata.bench.gallery

# The tools that `andabata bench` compares with.
peers: install
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[peers]'

clean:
	rm -rf $(VENV) .mypy_cache .ruff_cache .pytest_cache build dist *.egg-info
