import os

# One thread, as the rule says: then the sums in a training have the same bits on every machine. JAX reads it once.
os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} --xla_cpu_multi_thread_eigen=false"

from common.job import job
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
    )
