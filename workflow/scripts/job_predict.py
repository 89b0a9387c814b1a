from isarflow.core.job import job
from isarflow.learning.predict import Tested, add_up, predict

with job(snakemake):
    inputs = snakemake.input
    if inputs.added:
        add_up(inputs.added, inputs.model, snakemake.output.tables)
    else:
        predict(inputs.stores, Tested(**snakemake.params.settings), inputs.model, snakemake.output.tables)
