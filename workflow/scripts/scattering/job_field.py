from isarflow.core.job import job
from isarflow.scattering.external import write_external

with job(snakemake):
    settings = snakemake.params.settings
    sweep = settings["radar"], settings["aspect"]
    write_external(settings["field"], snakemake.output[0], *sweep, settings.get("symmetry", ()))
