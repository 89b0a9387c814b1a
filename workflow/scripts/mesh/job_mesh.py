from core.job import job
from mesh.build import write

with job(snakemake):
    settings = snakemake.params.settings
    write(
        snakemake.params.cad,
        settings["target"],
        settings["mesh"],
        settings["radar"],
        snakemake.output.summary,
        snakemake.output.source,
        snakemake.output.meshes,
    )
