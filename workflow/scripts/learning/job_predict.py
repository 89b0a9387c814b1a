from core.job import job
from learning.predict import predict

with job(snakemake):
    settings, inputs = snakemake.params.settings, snakemake.input
    predict(inputs.stores, settings["roles"], settings["open"], inputs.model, snakemake.output.tables)
