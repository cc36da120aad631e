# Everything a user or CI runs. Needs Python 3.11 to 3.13 and make; `make lock`, for developers, needs uv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: setup demo test test-fast test-long generators charts coverage format check wheel release-dry-run docs bench bench-find bench-knocked bench-confidence bench-plan bench-check bench-fccb bench-real bench-cost bench-boards bench-fields bench-segmentation bench-truth bench-service bench-faults bench-hostile bench-rate bench-versions bench-video bench-follow bench-live bench-seam-people bench-learned train lock clean

# What runs, without what tests, checks and clips need on top: a third of the size. Compiled where it is first imported.
$(VENV)/.runtime: docker/requirements.lock requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 14) and "ESC needs Python 3.11, 3.12 or 3.13; try: make PYTHON=python3.12 " or 0)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check --no-compile --require-hashes -r docker/requirements.lock
	sed -n '/^setuptools==/,/[^\\]$$/p' requirements.lock >$(VENV)/build.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r $(VENV)/build.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $@

demo: $(VENV)/.runtime
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m demo

setup: $(VENV)/.installed

$(VENV)/.installed: $(VENV)/.runtime
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m compileall -qq $(VENV)/lib || true
	touch $@

# Compiled files are kept even where the machine says not to: each of hundreds of processes would compile them anew.
PYTEST := PYTHONDONTWRITEBYTECODE= $(BIN)/pytest --dist=worksteal

# Every behaviour once; its accuracy and other parameters are left to `make test-long`. TESTS: some folders or files, default all.
test: setup
	$(PYTEST) --numprocesses=auto -m "not long" $(TESTS)

# For the loop of a day. Not in it: the whole service, its pages, older releases, servers, whole calibrations, the network.
test-fast: setup
	$(PYTEST) --numprocesses=logical -m "not (long or slow or servers)" \
		tests/fields tests/service tests/worker tests/openapi tests/test_architecture.py

# What CI runs after `make test`: proofs of accuracy, second parameters, a year of a venue; CONTRIBUTING.md says which.
test-long: setup generators charts
	$(PYTEST) --numprocesses=logical -m long $(TESTS)

# Generators of clients, which `make test-long` tries the OpenAPI document with. They want an older typer than ESC.
generators: $(VENV)/.generators

$(VENV)/.generators: tests/openapi/generators.lock
	$(PYTHON) -m venv $(VENV)/generators
	$(VENV)/generators/bin/pip install --quiet --disable-pip-version-check --require-hashes -r $<
	touch $@

# Helm and the schemas of Kubernetes, which `make test-long` tries the chart with.
charts: $(VENV)/.charts

$(VENV)/.charts: tests/charts.lock
	$(PYTHON) -m venv $(VENV)/charts
	$(VENV)/charts/bin/pip install --quiet --disable-pip-version-check --require-hashes -r $<
	touch $@

# Lines and branches that `make test` reaches, by rooms. By files, with the lines that nothing reaches: .venv/bin/coverage report
coverage: setup
	$(BIN)/coverage erase
	PYTHONDONTWRITEBYTECODE= $(BIN)/coverage run -m pytest --numprocesses=logical --dist=worksteal -m "not long" $(TESTS)
	$(BIN)/coverage combine --quiet
	$(BIN)/python -m tests.coverage_by_room

# What `make check` says of layout and imports, mended.
format: setup
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

check: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy --config-file benchmarks/mypy.ini
	$(BIN)/lint-imports
	$(BIN)/deptry .
	$(BIN)/python -m tests.openapi
	$(BIN)/python -m tests.prose
	$(BIN)/zizmor --offline --quiet --no-progress .github
	if command -v actionlint >/dev/null; then actionlint; else echo "actionlint is not installed: of the workflows only safety was checked"; fi

$(VENV)/.release: $(VENV)/.installed tools/requirements.lock
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r tools/requirements.lock
	touch $@

# The site of the documents into build/site, with every link and anchor checked.
docs: $(VENV)/.release
	$(BIN)/python -m tools.site build/site

# What an earlier build left in build/lib would go into the wheel.
wheel: setup
	rm -rf build/lib build/bdist.*
	$(BIN)/pip wheel --quiet --disable-pip-version-check --no-deps --no-build-isolation --wheel-dir dist . ./client

# All that can be tried of a release without publishing it; the files are in dist. Needs what is committed, not what is edited.
release-dry-run: $(VENV)/.release
	$(BIN)/python -m tools.release dist

# One BLAS thread, as the worker sets it.
BENCH := env OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 $(BIN)/python -m benchmarks

bench-real: setup
	$(BIN)/python -m benchmarks.real_pair
	$(BIN)/python -m benchmarks.seam

bench-fields: setup
	$(BENCH).fields

bench-find: setup
	$(BENCH).find

bench-knocked: setup
	$(BENCH).knocked

bench-confidence: setup
	$(BENCH).confidence

bench-plan: setup
	$(BENCH).planning

bench-check: setup
	$(BENCH).check

# The Fixed Camera Calibration Bench: benchmarks/fccb/README.md.
bench-fccb: $(VENV)/.bench
	$(BENCH).fccb make runs/fccb/public --seed 1
	$(BENCH).fccb table runs/fccb/public

# Needs GStreamer's RTSP server, as CONTRIBUTING.md says.
bench-live: setup
	$(BIN)/python -m benchmarks.live

bench-segmentation: $(VENV)/.train
	$(BIN)/python -m benchmarks.segmentation

bench-service: setup
	$(BIN)/python -m benchmarks.service

# SECONDS: how long each fault lasts.
SECONDS ?= 20
bench-faults: setup
	$(BIN)/python -m benchmarks.faults --seconds $(SECONDS)

bench-hostile: setup
	$(BIN)/python -m benchmarks.hostile

$(VENV)/.bench: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[bench]'
	touch $@

bench: $(VENV)/.bench
	$(BENCH).accuracy

# What `make bench` compares with and has to be trained, once: six hours of one core, less with a GPU (see --help).
bench-learned: $(VENV)/.bench
	nice -n 19 $(BENCH).learned

# ONLY: some of its parts, for instance `make bench-truth ONLY=nights`.
ONLY ?= lenses gate nights twice
bench-truth: $(VENV)/.bench $(VENV)/.train
	for part in $(ONLY); do $(BENCH).$$part || exit 1; done

# What a lens from a board is off by, and says, beside mrcal; needs the Debian packages mrcal and python3-mrcal.
bench-boards: setup
	$(BENCH).boards

# BEFORE: a clone of an earlier release with its .venv; `git worktree add ../esc-before v0.1.0 && make -C ../esc-before setup`.
bench-cost: setup
	$(BIN)/python -m benchmarks.cost $(if $(BEFORE),--before $(BEFORE))

bench-versions: setup
	$(BIN)/python -m benchmarks.versions

bench-rate: setup
	$(BIN)/python -m benchmarks.rate

bench-follow: setup
	$(BENCH).shaking
	$(BENCH).shaking --lens usual
	$(BENCH).shaking --size 4k --seconds 4
	$(BENCH).tracking_cost $(if $(BEFORE),--before $(BEFORE))

bench-seam-people: setup
	$(BENCH).seam_people

bench-video: setup
	$(BIN)/python -m benchmarks.stitch_video

$(VENV)/.train: $(VENV)/.installed
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[train]'
	touch $@

train: $(VENV)/.train
	OMP_WAIT_POLICY=passive nice -n 10 $(BIN)/python -m models.training.train

lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --group dev -o requirements.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --extra exr --extra tracing --constraint requirements.lock \
		-o docker/requirements.lock pyproject.toml
	uv pip compile --universal --python-version 3.11 --generate-hashes --group generators -o tests/openapi/generators.lock
	uv pip compile --universal --python-version 3.11 --generate-hashes --group charts -o tests/charts.lock
	uv pip compile --universal --python-version 3.11 --generate-hashes --group release --constraint requirements.lock \
		-o tools/requirements.lock

clean:
	rm -rf $(VENV) build dist *.egg-info client/build client/*.egg-info
