from isarflow.core.job import job
from isarflow.learning.data.export import export

with job(snakemake):
    settings = snakemake.params.settings
    targets = settings["roles"], settings["planes"]
    split = settings["learning.split"], settings["seed"], settings["imaging.aperture"]
    export(snakemake.input.stores, snakemake.output[0], *targets, *split)
