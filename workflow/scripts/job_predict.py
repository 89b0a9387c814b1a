from isarflow.core.job import job
from isarflow.learning.predict import Tested, predict

with job(snakemake):
    inputs = snakemake.input
    predict(inputs.stores, Tested(**snakemake.params.settings), inputs.model, snakemake.output.tables)
