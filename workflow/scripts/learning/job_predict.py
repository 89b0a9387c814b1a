from common.job import job
from learning.predict import predict

with job(snakemake):
    predict(snakemake.input.stores, snakemake.input.model, snakemake.output.table)
