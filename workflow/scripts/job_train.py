import os
from pathlib import Path

# One thread, as in the rule, and so the same bits on every machine. XLA takes the number of cores from here.
os.environ["NPROC"] = "1"

from isarflow.core.job import job
from isarflow.learning.train import Training, train

with job(snakemake):
    settings, model = dict(snakemake.params.settings), snakemake.wildcards.model
    own = settings.pop(f"learning.models.{model}")
    training = Training(model=model, settings=own, **settings)
    # Not in the output's folder: Snakemake removes it before a job and after a failed one.
    checkpoints = Path(snakemake.output.model).parents[2] / "checkpoints" / training.run["name"] / model
    train(snakemake.input.stores, training, snakemake.output.model, checkpoints)
