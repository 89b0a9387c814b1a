from isarflow.core.job import job
from isarflow.learning.evaluation.timing import measure

with job(snakemake):
    inputs, planes = snakemake.input, snakemake.params.settings["planes"]
    measure(inputs.stores, planes, inputs.models, snakemake.threads, snakemake.output.times)
