from isarflow.core.job import job
from isarflow.learning.evaluation.scores import over_seeds

with job(snakemake):
    over_seeds(snakemake.input.scores, snakemake.output[0])
