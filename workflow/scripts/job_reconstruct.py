from isarflow.core.job import job
from isarflow.learning.evaluation.reconstructions import reconstruct

with job(snakemake):
    inputs = snakemake.input
    reconstruct(inputs.stores, snakemake.params.settings["planes"], inputs.model, snakemake.output.reconstructions)
