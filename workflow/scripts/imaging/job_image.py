from isarflow.core.job import job
from isarflow.imaging.store import make_clean

with job(snakemake):
    mesh = snakemake.input.mesh or None
    make_clean(snakemake.input.field, mesh, snakemake.output[0], snakemake.params.settings["imaging"])
