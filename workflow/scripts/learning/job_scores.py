from core.job import job
from learning.scores import score

with job(snakemake):
    settings = snakemake.params.settings
    score(
        snakemake.input.predictions,
        settings["runs"],
        settings["seed"],
        snakemake.output.scores,
        snakemake.output.confusion,
        snakemake.output.validation,
    )
