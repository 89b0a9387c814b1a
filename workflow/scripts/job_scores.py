from isarflow.core.job import job
from isarflow.learning.evaluation import record
from isarflow.learning.evaluation.scores import score

with job(snakemake):
    settings, output = snakemake.params.settings, snakemake.output
    tables = output.scores, output.confusion, output.validation
    how = settings["runs"], settings["noise.definition"], settings["seed"], snakemake.threads
    score(snakemake.input.predictions, *how, *tables, settings["learning.kept"], settings["track"], settings["kinds"])
    record.write(output.record, settings, snakemake.input.predictions)
