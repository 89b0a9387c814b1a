from core.job import job
from scattering.external import write_external

with job(snakemake):
    settings = snakemake.params.settings
    write_external(settings["field"], snakemake.output[0], settings["radar"], settings["aspect"])
