from core.job import job
from learning.reconstructions import reconstruct

with job(snakemake):
    reconstruct(snakemake.input.stores, snakemake.input.model, snakemake.output.reconstructions)
