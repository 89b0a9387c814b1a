from isarflow.core.job import job
from isarflow.scattering.fields.external import write_external
from isarflow.scattering.fields.field_files import STEPS

with job(snakemake):
    settings = snakemake.params.settings
    sweep = settings["radar"], settings["aspect"]
    planes, origin = settings.get("symmetry", ()), snakemake.params.files
    steps = {key: settings[key] for key in STEPS if key in settings}
    write_external(settings["field"], snakemake.output[0], *sweep, planes, origin, steps)
