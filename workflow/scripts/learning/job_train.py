from common.job import job
from learning.train import train

with job(snakemake):
    settings = snakemake.params.settings
    experiment, model = snakemake.wildcards.experiment, snakemake.wildcards.model
    train(
        snakemake.input.stores,
        experiment,
        model,
        settings[f"learning.experiments.{experiment}.train"],
        settings[f"learning.models.{model}"],
        settings["learning.split"],
        settings["seed"],
        snakemake.output.model,
    )
