from common.job import job
from learning.scores import score

with job(snakemake):
    settings = snakemake.params.settings
    score(
        snakemake.input.predictions,
        settings["learning.experiments"],
        settings["learning.split.scheme"],
        settings["seed"],
        snakemake.output.scores,
        snakemake.output.confusion,
    )
