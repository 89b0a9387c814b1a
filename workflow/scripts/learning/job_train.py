import os
from pathlib import Path

# One thread, as the rule says, and so the same bits on every machine. XLA takes the number of cores from here.
os.environ["NPROC"] = "1"

from core.job import job
from learning.train import train

with job(snakemake):
    settings, model = snakemake.params.settings, snakemake.wildcards.model
    train(
        snakemake.input.stores,
        settings["roles"],
        settings["run"],
        model,
        settings[f"learning.models.{model}"],
        settings["learning.split"],
        settings["imaging.aperture"],
        settings["seed"],
        snakemake.output.model,
        # Not in the output's folder: Snakemake removes that before a job and after a failed one.
        Path(snakemake.output.model).parents[2] / "checkpoints" / settings["run"]["name"] / model,
    )
