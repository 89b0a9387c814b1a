import os
from pathlib import Path

# One thread, as in the rule, and so the same bits on every machine. XLA takes the number of cores from here.
os.environ["NPROC"] = "1"

from isarflow.core.job import job
from isarflow.learning.train import Training, train

with job(snakemake):
    settings, model = snakemake.params.settings, snakemake.wildcards.model
    training = Training(
        run=settings["run"],
        model=model,
        settings=settings[f"learning.models.{model}"],
        roles=settings["roles"],
        planes=settings["planes"],
        seed=settings["seed"],
    )
    # Not in the output's folder: Snakemake removes it before a job and after a failed one.
    checkpoints = Path(snakemake.output.model).parents[2] / "checkpoints" / settings["run"]["name"] / model
    train(snakemake.input.stores, training, snakemake.output.model, checkpoints)
