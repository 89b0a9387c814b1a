from isarflow.core.job import job
from isarflow.scattering.fields.external import write_external

with job(snakemake):
    settings = snakemake.params.settings
    sweep = settings["radar"], settings["aspect"]
    planes, origin = settings.get("symmetry", ()), snakemake.params.files
    write_external(settings["field"], snakemake.output[0], *sweep, planes, origin)
