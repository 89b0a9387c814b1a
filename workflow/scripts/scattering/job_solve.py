from core.job import job
from scattering.band import solve_band

with job(snakemake):
    settings = snakemake.params.settings
    solve_band(
        snakemake.input.mesh,
        snakemake.output[0],
        int(snakemake.wildcards.band),
        settings["mesh.bands"],
        settings["radar"],
        settings["aspect"],
        settings["scattering"],
        settings["symmetry"],
        snakemake.threads,
        snakemake.wildcards.target,
    )
