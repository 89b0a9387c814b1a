from common.job import job
from imaging.store import make_clean

with job(snakemake):
    make_clean(snakemake.input.field, snakemake.input.mesh, snakemake.output[0], snakemake.params.settings["imaging"])
