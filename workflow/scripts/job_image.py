from isarflow.core.job import job
from isarflow.imaging.store import make_clean

with job(snakemake):
    make_clean(snakemake.input.field, snakemake.output[0], snakemake.params.settings["imaging"])
