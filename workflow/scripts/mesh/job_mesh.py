from common.job import job
from mesh.build import write

with job(snakemake):
    write(
        snakemake.input.cad,
        snakemake.params.settings["target"],
        snakemake.params.settings["mesh"],
        snakemake.params.settings["radar"],
        snakemake.output.figures,
        snakemake.output.meshes,
    )
