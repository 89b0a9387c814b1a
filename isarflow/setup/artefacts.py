"""What a config makes: names of targets, runs and models, the paths of their artefacts, and what their jobs take."""

import itertools
import json
import os
from errno import ENOENT
from pathlib import Path

from isarflow.core import sweep
from isarflow.core.errors import InputError
from isarflow.core.folders import RECORD, SCORES, of_fields
from isarflow.core.kinds import FAMILIES, FOCUS, IMAGERS, SOLVERS, kind, of_focus, of_model
from isarflow.core.sweep import images_are_made
from isarflow.imaging.geometry import PURE_NOISE, megabytes, planned
from isarflow.learning import experiments
from isarflow.learning.classifier import OTHER
from isarflow.scattering import needs

# On a cluster a job's memory also holds the two Snakemakes that start it, 190 MB each; in part they share it.
STARTING = 400  # MB


class Plan:
    """The artefacts of a config.

    config: as `config.load_config` gives it; `further_seeds` and `compare` are taken out of it.
    results: its folder, results/<name>; fields: that of meshes and fields, of this run or of the one that has them.
    targets, meshed, given: names of all, of those that are a mesh, which is solved, further poses of targets among
    them, and of fields from elsewhere.
    seeded: the config for each of its seeds, by the folder of what follows from the seed: of further seeds one in the
    run's own. compared: other runs by name.
    runs_of: the learning stage's runs by name, by that folder; runs: those of the first seed.
    fitted, timed: run and model, as their folders are called; those that times are measured of, of the first fold.
    snrs: their labels, as in file names.
    """

    def __init__(self, config):
        self.results = f"results/{config['name']}"
        further, self.compared = config.pop("further_seeds", []), config.pop("compare", [])
        self.config, self.fields = config, of_fields(self.results, config).as_posix()
        self.seeded = {self.results: config}
        self.seeded |= {f"{self.results}/seed_{seed}": {**config, "seed": seed} for seed in further}
        self.targets = experiments.imaged(config)
        self.meshed = [name for name, target in config["targets"].items() if "field" not in target]
        self.given = [target for target in self.targets if target not in self.meshed]
        self.known, self.unknown = (
            sorted(name for name in self.targets if config["targets"][name]["role"] == role)
            for role in ("known", "unknown")
        )
        self.bands = range(config["mesh"]["bands"])
        # In one order whatever the config's.
        self.runs_of = {
            root: dict(sorted(experiments.runs(own).items())) if images_are_made(config) else {}
            for root, own in self.seeded.items()
        }
        self.runs, self.models = self.runs_of[self.results], config["learning"]["models"]
        self.fitted, self.timed = (
            sorted(f"{name}/{model}" for name, run in runs.items() for model in run["models"])
            for runs in (self.runs, {name: run for name, run in self.runs.items() if run["first"]})
        )
        self.snrs = [sweep.snr_label(snr) for snr in config["noise"]["snr_db"]]
        # Motion by the folder of its images; that of the config's section is in `imaging`.
        self.motions = {"imaging": dict(sorted(config["motion"].items()))}
        self.motions |= {self.folder(name): run["motion"]["limits"] for name, run in self.runs.items() if run["motion"]}

    def poses(self, target):
        """The names of the further poses of a target, each solved as a target of its own."""
        return self.config["targets"][target].get("poses", [])

    def symmetry(self, target):
        return self.config["targets"][target].get("symmetry", [])

    def cost_of_solve(self, target, band, measures):
        """Estimate what a solve needs, its `megabytes` and `seconds`. measures: the path of its mesh's JSON.

        Raises FileNotFoundError where it holds no such band, as a mesh that is yet to be made again.
        """
        bands = json.loads(Path(measures).read_text())["bands"]
        if band >= len(bands):
            raise FileNotFoundError(ENOENT, "no such band", measures)
        config = self.config
        asked = sweep.sweeps(config["radar"], config["aspect"], len(self.bands), config["scattering"])[band]
        return needs.need(bands[band], len(self.symmetry(target)), asked, needs.method(config, target))

    def image_megabytes(self, copies):
        """The memory of a job that makes so many copies of a target's images."""
        return STARTING + int(megabytes(planned(self.config), copies))

    def kind(self, model):
        """What the file of a model of the config says of itself."""
        return of_model(self.models, model)

    def model_files(self, *names):
        """The files of models, <model> or <run>/<model>, which jobs load by name, each model's once."""
        named = {name.split("/")[-1] for name in names}
        named |= {member for name in named for member in experiments.members(self.models, name)}
        return [self.kind(model).file for model in sorted(named)]

    def imager_file(self):
        return kind(IMAGERS, self.config["imaging"]["imager"]).file

    def focus_file(self):
        return kind(FOCUS, of_focus(self.config["imaging"])[0]).file

    def imager_files(self):
        """The files of the config's imager and of those that the page compares."""
        compared = [settings["imager"] for settings in self.config.get("imagers", {}).values()]
        return [kind(IMAGERS, name).file for name in sorted({self.config["imaging"]["imager"], *compared})]

    def solver_file(self):
        return kind(SOLVERS, self.config["scattering"]["solver"]).file

    def generator_file(self, target):
        return kind(FAMILIES, self.config["targets"][target]["family"]["kind"]).file

    def trained_targets(self, run, model):
        """The targets that a model learns: the known ones, and those of role other for one with such a class."""
        roles = {"known", "other"} if self.models[model].get("other", False) else {"known"}
        there = [name for name in self.targets if self.config["targets"][name]["role"] in roles]
        return [name for name in there if name not in self.runs[run]["without"] and self._side(run, name) != "test"]

    def _side(self, run, target):
        """The side of a target by family; None by a split of views."""
        return self.runs[run]["division"]["settings"].get("sides", {}).get(target)

    def training_stores(self, root, run, model):
        """The stores of images that a model learns from."""
        stores, labels = [], [experiments.label(snr) for snr in self.runs[run]["snrs"]]
        for target in self.trained_targets(run, model):
            # Of another seed, and moved, are only those with noise.
            clean, noisy = f"{self.results}/imaging", f"{root}/{self.folder(run)}"
            stores += [f"{clean if label == experiments.CLEAN else noisy}/{target}/{label}.zarr" for label in labels]
        noise = self.models[model].get("other", False) or self.kind(model).stated.get("learns_noise", False)
        return [*stores, f"{root}/imaging/{PURE_NOISE}/clean.zarr"] if noise else stores

    def tested_targets(self, run):
        """The targets that a run is tested on, or chooses thresholds with."""
        every = self.targets if self.runs[run]["open"] else self.known
        return [name for name in every if self._side(run, name) != "train"]

    def tested_snrs(self, run):
        """The labels of the SNRs that a run is tested at."""
        tested = self.runs[run]["tested"]
        return [sweep.snr_label(snr) for snr in self.config["noise"]["snr_db"] if tested == "all" or snr in tested]

    def folder(self, run):
        """The folder, within that of a seed, of the noisy images that a run sees."""
        return self.runs[run]["motion"].get("folder", "imaging")

    def noises(self, snrs):
        """The folders of noisy images at some of these SNRs, by those: {labels: folders}."""
        folders = {tuple(snrs): ["imaging"]}
        for folder in [folder for folder in self.motions if folder != "imaging"]:
            tested = {snr for run in self.runs if self.folder(run) == folder for snr in self.tested_snrs(run)}
            made = tuple(snr for snr in snrs if snr in tested)
            if made:
                folders.setdefault(made, []).append(folder)
        return folders

    def tests(self, snrs):
        """The runs that are tested at some of these SNRs, by what they are tested at: {labels: names of runs}."""
        runs = {}
        for run in self.runs:
            every = self.tested_snrs(run)
            runs.setdefault(tuple(snr for snr in snrs if snr in every), []).append(run)
        return {tested: runs[tested] for tested in sorted(runs, key=len, reverse=True) if tested}

    def added(self, model):
        """The models whose predictions a model adds up; [] of one that sees images."""
        return experiments.members(self.models, model) if "added" in self.kind(model).methods else []

    def predictions(self, root):
        """The tables of predictions of all runs and models in a folder `root`."""
        tables = [(fitted, snr) for fitted in self.fitted for snr in self.tested_snrs(fitted.split("/")[0])]
        return [f"{root}/learning/predictions/{fitted}/{snr}.csv" for fitted, snr in tables]

    def decoders(self):
        """The models with a decoder, <run>/<model>, in runs that are tested on unknown targets."""
        pairs = [fitted.split("/") for fitted in self.timed]
        decoding = [(run, model) for run, model in pairs if "reconstruct" in self.kind(model).methods]
        return [f"{run}/{model}" for run, model in decoding if self.runs[run]["open"]]

    def of_targets(self, targets):
        """Roles, classes and mirror planes of these targets, for params."""
        names, said = sorted(targets), self.config["targets"]
        return {
            "roles": {name: said[name]["role"] for name in names},
            "classes": {name: experiments.class_of(said, name) for name in names},
            "planes": {name: sorted(self.symmetry(name)) for name in names},
        }

    def track(self):
        """The models whose scores add up over looks, degrees between azimuths, and azimuths of an aperture."""
        named = sorted({model for run in self.runs.values() for model in run["models"]})
        additive = [model for model in named if self.kind(model).stated.get("additive", False)]
        first, second, *_ = sweep.azimuths(self.config["aspect"])
        return [additive, float(second - first), self.config["imaging"]["aperture"]]

    def families(self):
        """The `kinds` of all targets and what they stand for, their `classes`, where an experiment is by family."""
        by_family = any(experiments.is_by_family(run) for run in self.runs.values())
        targets = {name: self.config["targets"][name] for name in sorted(self.targets)} if by_family else {}
        classes = {name: experiments.class_of(targets, name) for name in targets if targets[name]["role"] == "known"}
        kinds = {name: experiments.kind_of(targets, name) for name in targets}
        return {"kinds": kinds, "classes": dict.fromkeys(targets, OTHER) | classes}

    def tested_realizations(self):
        """How many realizations of each view's noise are tested."""
        tested, every = self.config["learning"]["realizations"], self.config["noise"]["realizations"]
        return every if tested == "all" else min(tested, every)

    def megabytes(self, run, model):
        """The memory of a job of a model, in MB; one that adds others' scores has all of these in memory."""
        if members := experiments.members(self.models, model):
            return sum(self.megabytes(run, member) for member in members)
        trained = len(self.trained_targets(run, model))
        run, images, copies = self.runs[run], planned(self.config), self.config["noise"]["realizations"]
        sampled = images["range_pixels"] * images["crossrange_pixels"]
        pixels = sampled if run["upsample"] == "none" else run["upsample"] ** 2
        pixels *= experiments.channels_of(run, images["channels"])
        sets = sum(1 if snr == experiments.CLEAN else copies for snr in run["snrs"])
        # A prediction reads the noisy images of a target at a time.
        sets, stated = max(trained * sets, copies), self.kind(model).stated
        covariances = len(run["snrs"]) if stated.get("covariances", False) else 0
        return int(experiments.megabytes(images["images"] * sets, pixels, covariances, stated.get("pairs", False)))

    def most_megabytes(self, fitted, least):
        """The largest memory of jobs of these models, <run>/<model>, and at least so much."""
        return max([self.megabytes(*name.split("/")) for name in fitted], default=least)

    def roots(self):
        """The folders of the runs to compare, by name: this one, its other seeds, and other runs.

        Raises InputError where another run has no scores, and where there would be nothing to compare.
        """
        roots = {self.config["name"]: self.results}
        roots |= {os.path.basename(root): root for root in self.seeded if root != self.results}
        roots |= {name: f"results/{name}" for name in self.compared}
        if len(roots) < 2:
            runs = "Name other runs of this folder (--config compare='[quick]'), or give 'seed' several values."
            raise InputError(f"config key 'compare': there is nothing to compare this run with. {runs}")
        for root, file in itertools.product(roots.values(), (SCORES, RECORD)):
            if root not in self.seeded and not Path(root, file).is_file():
                have = sorted(path.parents[1].name for path in Path("results").glob(f"*/{RECORD}"))
                missing = f"there is no {root}/{file}; make that run first, with its own config"
                raise InputError(f"config key 'compare': {missing}. There are: {', '.join(have) or 'none'}.")
        return roots

    def judged(self, root):
        """What a run's differences to another come from: its scores, predictions, and what its models are."""
        scores, learning = [f"{root}/{SCORES}", f"{root}/{RECORD}"], Path(root, "learning")
        if root in self.seeded:
            models = [f"{learning}/models/{fitted}" for fitted in self.fitted]
            return [*scores, *models, *self.predictions(root)]
        # Another run has a config of its own: what it has made says what it is.
        files = [*learning.glob("predictions/*/*/*.csv"), *learning.glob("models/*/*/config.json")]
        return [*scores, *sorted(map(str, files))]
