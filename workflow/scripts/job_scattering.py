from isarflow.core.job import job
from isarflow.scattering.fields.store import join_bands

with job(snakemake):
    join_bands(snakemake.input.bands, snakemake.output[0], poses=snakemake.input.poses)
