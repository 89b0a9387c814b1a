from isarflow.core.job import job
from isarflow.imaging.store import make_pure_noise

with job(snakemake):
    settings = snakemake.params.settings
    make_pure_noise(settings["radar"], settings["aspect"], snakemake.output[0], settings["imaging"], settings["seed"])
