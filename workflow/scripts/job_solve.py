from isarflow.core.job import job
from isarflow.core.sweep import sweeps
from isarflow.scattering.band import solve_band

with job(snakemake):
    settings = snakemake.params.settings
    scattering, band, target = settings["scattering"], int(snakemake.wildcards.band), snakemake.wildcards.target
    sweep = sweeps(settings["radar"], settings["aspect"], settings["mesh.bands"], scattering)[band]
    how = scattering, settings["symmetry"], snakemake.threads
    solve_band(snakemake.input.mesh, snakemake.output[0], sweep, *how, target)
