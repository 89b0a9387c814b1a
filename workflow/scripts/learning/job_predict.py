from core.job import job
from learning.predict import predict

with job(snakemake):
    settings = snakemake.params.settings
    predict(
        snakemake.input.stores,
        settings["roles"],
        settings["open"],
        snakemake.input.model,
        snakemake.output.tables,
    )
