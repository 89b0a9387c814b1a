from core.job import job
from learning.timing import measure

with job(snakemake):
    measure(snakemake.input.stores, snakemake.input.models, snakemake.threads, snakemake.output.times)
