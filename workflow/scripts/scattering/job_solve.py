from isarflow.core.job import job
from isarflow.core.sweep import sweeps
from isarflow.scattering.band import solve_band

with job(snakemake):
    settings = snakemake.params.settings
    solve_band(
        snakemake.input.mesh,
        snakemake.output[0],
        sweeps(settings["radar"], settings["aspect"], settings["mesh.bands"], settings["scattering"])[
            int(snakemake.wildcards.band)
        ],
        settings["scattering"],
        settings["symmetry"],
        snakemake.threads,
        snakemake.wildcards.target,
    )
