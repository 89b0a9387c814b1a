# make smoke:  the smallest experiment, in a minute or two: results/smoke/report/index.html
# make report: the default experiment, from CAD to results/quick/report/index.html
# make thesis: the reference experiment at full size, from the fields of resources/fields (hours of learning)
# make recognition: the same at full size in three polarizations: docs/recognition.md (half an hour), published
# make recommended: scatterers assigned, matrix capsules, a Wiener filter or an autoencoder first, for docs/recognition.md (two hours), published
# make models: what the thesis's figures are with other drones and missiles, for docs/results.md (two hours), published
# make benchmark: fifteen targets, five protocols, the leaderboard of docs/benchmark.md (an hour), published
# make kinds: whether models of kinds are recognised that never trained, docs/kinds.md (75 minutes), published
# make kinds-growth: AUROC over models, other kinds, polarizations and resolution (an hour and a half)
# make flight: drone, bird or missile in flight, from kept fields, for docs/flight.md (half an hour), published
# make flight-steps: the way there from the laboratory, and what is otherwise (an hour), published
# make test:   the whole test suite;   make lint: what CI checks besides
# make docs: the pages as a site, results/docs/index.html
# make bench-scattering: what a solve costs against what the machine can do (run nothing beside it)
# make bench-learning: prediction times at the reference experiment's size
# make bench-capsules: what the capsule network's training and prediction take, also with other convolutions
# make bench-training: F1 of the full-size capsule network against steps of training, by several readings (on a GPU)
# make bench-thesis: solves at full size (20 minutes, 6 GB), and the whole reference experiment projected from them
# make bench-compressed: compressed matrices beside whole ones, over unknowns and tolerance (half an hour, 6 GB)
# make bench-mesh: 200 random vehicles of overlapping solids meshed, which are refused or miss a goal (an hour)
# make bench-habits: CAD files of forty makers' habits meshed: fans, rivets, capped halves, patches, slivers (ten minutes)
# make bench-meshing: what meshing takes beside solving: the default targets, a UAV, half a million triangles (ten minutes)
# make bench-shapes: fields of targets with fine features beside those of finer meshes (five minutes)
# make bench-sheets: shells of thin materials beside their series, and how thick a sheet may be (two minutes)
# make bench-flyers: a plastic drone and a bird of water beside their metal twins (a minute)
# make bench-surfaces: where a surface impedance stands for an opaque body or a coating, by series and solves (five minutes)
# make bench-imaging: 1,172,490 images from made-up fields, beside the disk's speed
# make bench-imagers: two points by each imager, over distance, SNR and gaps (ten minutes)
# make bench-focus: focus methods on points and on the dataset's targets, over motion (five minutes)
# make bench-motion: F1 over displacement and drift, by search and by focus (a quarter of an hour)
# make bench-imaged: what is recognised on images of each imager, after `make report` (five minutes)
# make bench-denoised: why a Wiener filter in front of ZNCC helps so little, after `make recommended` (five minutes)
# make bench-optics: physical optics and rays beside the dataset: errors, images, recognition (a quarter of an hour)
# make bench-centres: where scattering centres lie on five targets, against edges and tips (a quarter of an hour)
# make bench-bempp: the same sphere by bempp-cl, in an environment of its own, and here
# make fields: the dataset of resources/fields anew where it is not complete (hours, 6 GB)
# make bench-device BANDS="drone-0 drone-1": bands of the dataset on the device JAX finds, beside the kept fields
# make gpu: where JAX finds a GPU, within 12 minutes: tests, trainings, and bands of the dataset, beside the processor
# make check-fields: its fields beside those of finer meshes and of the other integral equation (hours, 20 GB)
# make results: publish the full-size run's page of the reference thesis, docs/results.md, and its scores (RUN=thesis)
# make validate: the solver and the image formation beside closed forms, as figures (docs/validation.md)

PYTHON ?= python3
CORES ?= 2
RUN ?= thesis
BIN := .venv/bin
export PATH := $(CURDIR)/$(BIN):$(PATH)

.PHONY: smoke optics-meshes aircraft-meshes flyers-images rays report thesis recognition recommended models benchmark kinds kinds-growth flight flight-steps test lint docs environment results validate \
	fields check-fields bench-device gpu

smoke: environment
	snakemake --cores $(CORES) report --configfile config/smoke.yaml

report: environment
	snakemake --cores $(CORES) report

thesis: environment
	snakemake --cores $(CORES) report thesis_page --configfile config/thesis.yaml config/thesis-fields.yaml

recognition: environment
	snakemake --cores $(CORES) results/recognition/learning/scores.csv \
		--configfile config/thesis.yaml config/thesis-fields.yaml config/recognition.yaml
	PYTHONPATH=studies/stewart-burger-2023 python resources/results/recognition.py results/recognition

recommended: environment
	snakemake --cores $(CORES) results/recommended/learning/scores.csv \
		--configfile config/thesis.yaml config/thesis-fields.yaml config/recognition.yaml config/recommended.yaml
	snakemake --cores $(CORES) results/recommended-models/learning/scores.csv \
		--configfile config/flight.yaml config/recommended-models.yaml
	PYTHONPATH=studies/stewart-burger-2023 python resources/results/recommended.py results/recommended results/recommended-models

models: environment
	python resources/results/models.py --cores $(CORES)

benchmark: environment
	snakemake --cores $(CORES) benchmark --configfile config/benchmark.yaml
	PYTHONPATH=studies/stewart-burger-2023 python resources/results/leaderboard.py results/benchmark

kinds: environment
	snakemake --cores $(CORES) benchmark --configfile config/families-fields.yaml config/kinds.yaml
	PYTHONPATH=studies/stewart-burger-2023:resources/cad python resources/results/kinds.py results/kinds

kinds-growth: bench-kinds
	cp results/benchmarks/kinds-growth.csv resources/results/kinds/growth.csv
	cp results/benchmarks/kinds-growth.png docs/img/kinds-growth.png

flight: environment
	snakemake --cores $(CORES) report --configfile config/flight.yaml
	PYTHONPATH=studies/stewart-burger-2023 python resources/results/flight.py results/flight

flight-steps: environment
	for run in flight-metal flight-otherwise; do \
		snakemake --cores $(CORES) results/$$run/learning/scores.csv --configfile config/flight.yaml config/$$run.yaml && \
		PYTHONPATH=studies/stewart-burger-2023 python resources/results/flight.py results/$$run || exit 1; \
	done

test: environment
	python -m pytest -n $(CORES) --dist loadfile --no-loadscope-reorder

lint: environment
	ruff check .
	ruff format --check .
	snakefmt --check Snakefile workflow/rules
	snakemake --lint
	lint-imports
	mypy

docs: environment
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r envs/requirements-docs.lock
	$(BIN)/python -m sphinx -W --keep-going -q -b html -c docs . results/docs
	cp results/docs/README.html results/docs/index.html

fields: environment
	missing=$$(python resources/fields/make.py missing) && \
		{ [ -z "$$missing" ] || snakemake --cores $(CORES) $$missing --configfile config/thesis.yaml config/fields.yaml; }
	python resources/fields/make.py keep
	python resources/fields/make.py publish
	python resources/fields/make.py splits

bench-device: environment
	snakemake --cores $(CORES) $(foreach target,$(sort $(foreach band,$(BANDS),$(firstword $(subst -, ,$(band))))),results/fields/mesh/$(target).json) \
		--configfile config/thesis.yaml config/fields.yaml
	python benchmarks/bench_device.py --threads $(CORES) $(BANDS)

# Each part ends in time, and the next one follows whatever it says. Several processes share the GPU's memory.
gpu: export XLA_PYTHON_CLIENT_PREALLOCATE = false
gpu: environment
	python -c "import jax; assert jax.default_backend() == 'gpu', 'JAX finds no GPU: .venv/bin/pip install jax[cuda12]'"
	-timeout 220 python -m pytest -q -n 8 --maxfail 20 tests/scattering tests/learning
	-timeout 180 python benchmarks/bench_networks.py
	-timeout 320 $(MAKE) bench-device BANDS="satellite-6 drone-0 drone-6 aircraft-6"

check-fields: environment
	python resources/fields/check.py --threads $(CORES)
	python resources/fields/make.py card

results: environment
	python studies/stewart-burger-2023/publish.py results/$(RUN)

validate: environment
	PYTHONPATH=tests/scattering python benchmarks/validate.py --threads $(CORES)

# Of a bench that needs more than this, the prerequisites stand below.
bench-%: environment
	PYTHONPATH=tests/mesh:tests/scattering python benchmarks/bench_$*.py --threads $(CORES)

bench-optics: optics-meshes rays
bench-centres: optics-meshes
bench-compressed: aircraft-meshes
bench-bempp: .venv-bempp/.installed
bench-flyers: flyers-images

# Ten edges a wavelength at the highest frequency.
optics-meshes: environment
	snakemake --cores $(CORES) $(patsubst resources/fields/%.zarr,results/optics/mesh/%.json,$(wildcard resources/fields/*.zarr)) \
		--configfile config/thesis.yaml config/fields.yaml --config name=optics mesh='{bands: 1}'

aircraft-meshes: environment
	snakemake --cores $(CORES) results/quick/mesh/aircraft.json

flyers-images: environment
	snakemake --cores $(CORES) $(patsubst %,results/flyers-fields/imaging/%_01/clean.zarr,drone_plastic bird_water) \
		--configfile config/flyers-fields.yaml
	snakemake --cores $(CORES) $(patsubst %,results/flyers-metal-fields/imaging/%_01/clean.zarr,drone_plastic bird_water) \
		--configfile config/flyers-metal-fields.yaml

rays: environment
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r envs/requirements-rays.lock

.venv-bempp/.installed: envs/requirements-bempp.txt
	rm -rf .venv-bempp
	$(PYTHON) -m venv .venv-bempp
	.venv-bempp/bin/python -m pip install --quiet --disable-pip-version-check -r envs/requirements-bempp.txt
	touch $@

environment: $(BIN)/.installed

# The stamp is written last: an interrupted installation is begun anew. It holds the folder's path: the programs of an
# environment know where they were installed, and one that was moved or copied is made anew.
HERE := $(shell cat $(BIN)/.installed 2> /dev/null)
ifneq ($(HERE),$(CURDIR))
.PHONY: $(BIN)/.installed
endif

$(BIN)/.installed: envs/requirements.lock
	@command -v $(PYTHON) > /dev/null || \
		{ echo "There is no $(PYTHON). On Debian or Ubuntu: apt-get install -y python3-venv; or name one: make PYTHON=..."; exit 1; }
	@$(PYTHON) envs/check.py
	@echo "installing the environment into .venv (a minute or two)"
	rm -rf .venv
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r envs/requirements.lock
	@$(BIN)/python -c "import sys, sysconfig; open(sysconfig.get_path('purelib') + '/isarflow.pth', 'w').write(sys.argv[1])" "$(CURDIR)"
	@printf '%s' "$(CURDIR)" > $@
