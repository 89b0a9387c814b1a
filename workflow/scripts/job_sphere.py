from isarflow.core.job import job
from isarflow.scattering.sphere import check

with job(snakemake):
    settings = snakemake.params.settings
    check(snakemake.output[0], settings["scattering"], settings["mesh.edges_per_wavelength"], snakemake.threads)
