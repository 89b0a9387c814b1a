from isarflow.core.job import job
from isarflow.report.side_by_side import write_comparison

with job(snakemake):
    settings, output = snakemake.params.settings, snakemake.output
    how = settings["noise.definition"], settings["seed"], settings["learning.kept"]
    write_comparison(settings["roots"], *how, output.page, output.table, *snakemake.input.over_seeds)
