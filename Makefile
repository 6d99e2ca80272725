# make demo and make test do all the set-up themselves, once. ARGS goes to the tool: make test ARGS="tests/store -x".
.DEFAULT_GOAL := help
.PHONY: object-store dcc-reader newest-duckdb growth soak supply browser challenge fuzz fuzz-http load concurrency kills lake manual pages real-data help setup demo test slow check format bench trials wheel wheel-parts clean distclean
.NOTPARALLEL:

export MAKECMDGOALS
RUN := .venv/bin/python
PYTEST := $(RUN) -m pytest
# A worker a core; -n 0 in ARGS runs them one after the other, in this process. A file stays with one worker, in its order,
# so that what its tests share is made once and no run depends on the clock.
PARALLEL := -n auto --dist loadfile --no-loadscope-reorder
# The tests write thousands of small files: in memory, where the machine offers it and has 4 GB there.
IN_MEMORY := $(shell test -w /dev/shm && df -Pk /dev/shm | awk 'NR == 2 && $$4 > 4e6 { print "PYTEST_DEBUG_TEMPROOT=/dev/shm" }')
# pytest ends with status 5 where there is nothing to collect; that is no failure for what may be empty.
MAY_BE_EMPTY := || test $$? -eq 5

help:  ## what there is
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 18

setup:
	@PYTHON='$(PYTHON)' sh tests/setup/prepare.sh

demo: setup  ## the main job on the example campaigns; leaves its results in demo-output/
	@.venv/bin/monitor demo --out demo-output $(ARGS)

test: setup  ## the tests
	@$(IN_MEMORY) $(PYTEST) $(PARALLEL) $(ARGS)

slow: setup  ## the tests that make test leaves out or does less of: long ones that rarely fail
	@$(IN_MEMORY) $(PYTEST) $(PARALLEL) --slow $(ARGS)

check: setup  ## format, lint, types
	@$(RUN) -m ruff format --check .
	@$(RUN) -m ruff check .
	@$(RUN) -m mypy

format: setup  ## put the sources into the project's format
	@$(RUN) -m ruff check --fix-only .
	@$(RUN) -m ruff format .

bench: setup  ## how long things take (tests/benchmarks)
	@$(PYTEST) tests/benchmarks --benchmark-only $(ARGS) $(MAY_BE_EMPTY)

real-data: setup  ## docs/real-data.md and its pictures, from the measured series of NIST
	@OMP_NUM_THREADS=1 $(RUN) tests/curves/real_data.py $(ARGS)

browser: setup
	@sh tests/setup/browser.sh

pages: browser  ## the pages in a real browser; pictures of every page in pages-output/
	@$(PYTEST) $(PARALLEL) tests/browser $(ARGS)

fuzz-http: setup  ## the whole HTTP interface by schemathesis (docs/reliability.md); some ten minutes
	@$(RUN) -c 'import schemathesis' 2>/dev/null || $(RUN) -m pip install --quiet --constraint constraints.txt 'schemathesis>=4'
	@OMP_NUM_THREADS=1 $(RUN) tests/web/fuzz_http.py $(ARGS)

load: setup  ## 50 engineers at once while an import runs; trend pages of a large fleet (docs/benchmarks.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/load_pages.py many $(ARGS)
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/load_pages.py large --machines 1000 --weeks 100 $(ARGS)

dcc-reader: setup  ## digital certificates read by PyDCC and PTB's dccQuantities, each in an environment of its own
	@sh tests/setup/dcc_reader.sh
	@$(PYTEST) -n 0 --slow tests/reporting/test_pydcc.py tests/reporting/test_dcc_quantities.py $(ARGS)

manual: setup  ## the manual as a site in manual-output/, and every block of code of its pages
	@$(RUN) -c 'import furo, latex2mathml, myst_parser, sphinx' 2>/dev/null || $(RUN) -m pip install --quiet --constraint constraints.txt furo latex2mathml myst-parser sphinx
	@OMP_NUM_THREADS=1 $(RUN) docs/site/build.py
	@$(IN_MEMORY) $(PYTEST) $(PARALLEL) --dist load tests/manual $(ARGS)

trials: setup  ## slow trials over many seeds, an hour; their last results are in docs/trials-*.md
	@$(PYTEST) $(PARALLEL) --all-seeds --timeout 3600
	@$(PYTEST) $(PARALLEL) tests/benchmarks/trial_dcc_examples.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_discovery.py --seeds 10 --empties 500 --processes 2 $(ARGS)
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_unknown.py --seeds 3 --empties 60
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_empty.py --seeds 300 --seconds 1200
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_statistics.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_days.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_signed.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_weekly.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_ties.py 20
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_dependence.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_event_oracle.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_event_drift.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_robots.py --seeds 10
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_mounts.py --seeds 30
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_instruments.py --seeds 300
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_tool_points.py --seeds 240
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_who_contradicts.py --seeds 20
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_methods.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_regions.py --replicates 80
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_outliers.py
	@OMP_NUM_THREADS=1 $(RUN) tests/benchmarks/trial_curve.py --seeds 40

concurrency: setup  ## eight importers and twenty readers at one database for ten minutes (docs/reliability.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/soak/concurrency.py $(ARGS)

kills: setup  ## eighteen verbs killed 500 times at random moments (docs/reliability.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/soak/kills.py $(ARGS)

soak: setup  ## a shop for an hour: imports, reports, pages, publishing and kills together (docs/reliability.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/soak/soak.py $(ARGS)

object-store: setup  ## a lake whose files lie in an object store, that of moto on loopback (docs/scale.md)
	@sh tests/setup/object_store.sh
	@OMP_NUM_THREADS=1 $(RUN) -m pytest -n 0 -q tests/store/test_object_store.py $(ARGS)

growth: setup  ## bytes a campaign over simulated years, backups, archive, compaction (docs/reliability.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/soak/growth.py $(ARGS)

newest-duckdb: setup  ## the whole suite against the newest DuckDB that can be had (docs/reliability.md)
	@OMP_NUM_THREADS=1 $(RUN) tests/setup/newest_duckdb.py $(ARGS)

lake: setup  ## plants that publish to one lake at once, some killed in the middle (docs/scale.md); needs PostgreSQL
	@OMP_NUM_THREADS=1 $(RUN) tests/soak/lake.py $(ARGS)

fuzz: setup  ## coverage-guided inputs for all that reads text, ten minutes a target (docs/reliability.md)
	@$(RUN) -c 'import atheris' 2>/dev/null || $(RUN) -m pip install --quiet 'atheris>=3'
	@OMP_NUM_THREADS=1 $(RUN) tests/fuzz/fuzz.py $(ARGS)

# CAMPAIGNS=40 writes and answers fewer of them, DIR=... elsewhere.
CAMPAIGNS ?= 1000
DIR ?= demo-output/challenge
challenge: setup  ## campaigns with sealed truth, answered by ours and four others (docs/challenge.md); hours for 1000
	@$(RUN) -m pip install --quiet --constraint constraints.txt 'scikit-learn>=1.5' 'knockpy>=1.3'
	@$(RUN) tests/challenge/generate.py $(DIR) --campaigns $(CAMPAIGNS)
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(RUN) tests/challenge/answer.py $(DIR) $(ARGS)
	@$(RUN) tests/challenge/score.py $(DIR)

wheel: setup  ## build the wheel and run the whole suite against it (as long as make test); wheel-parts is the quick one
	@$(RUN) tests/setup/installed_wheel.py $(PARALLEL) $(ARGS)

# What a wheel can lack: files of the package, so migrations, templates, fonts and pages (make test compares them one by
# one: tests/test_wheel.py); what is imported and not declared (tests/test_walls.py, late imports too); the command. Each
# is met here once in the installed wheel; what the code does, make test has shown.
WHEEL_PARTS := tests/test_wheel.py tests/cli/test_certificates.py tests/cli/test_usage.py tests/store/test_migrations.py \
	tests/reporting/test_dcc.py tests/reporting/test_render.py::test_templates_and_fonts_with_their_licence_are_found \
	tests/web/test_layout.py tests/web/test_safety.py tests/web/test_pages.py
wheel-parts: setup  ## build the wheel and run the tests of what a wheel can lack
	@$(RUN) tests/setup/installed_wheel.py $(WHEEL_PARTS) $(PARALLEL) $(ARGS)

supply: setup  ## wheel with its bill of materials in dist/, docs/licences.md, the hashes of all pins
	@$(RUN) -m pip install --quiet --constraint constraints.txt 'cyclonedx-bom>=7' 'pip-licenses>=5' 'uv>=0.9'
	@$(RUN) tests/setup/supply.py

clean:  ## remove what the others left, except the virtual environment
	@rm -rf demo-output fuzz-output manual-output pages-output build dist .benchmarks .hypothesis .mypy_cache .pytest_cache .ruff_cache *.egg-info
	@find monitor migrations reports tests examples -name __pycache__ -prune -exec rm -rf {} +

distclean: clean  ## remove the virtual environment too
	@rm -rf .venv
