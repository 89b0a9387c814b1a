from isarflow.core.job import job
from isarflow.mesh.build import write

with job(snakemake):
    output = snakemake.output
    write(snakemake.params.cad, snakemake.params.settings, output.measures, output.source, output.meshes)
