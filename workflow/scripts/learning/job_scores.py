from core.job import job
from learning.scores import score

with job(snakemake):
    settings, output = snakemake.params.settings, snakemake.output
    tables = output.scores, output.confusion, output.validation
    score(snakemake.input.predictions, settings["runs"], settings["seed"], *tables)
