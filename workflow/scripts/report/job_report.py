from pathlib import Path

from isarflow.core.job import job
from isarflow.report.page import write_report

with job(snakemake):
    output, params = snakemake.output, snakemake.params
    folder = Path(output.page).parents[1]
    files = output.page, output.figures, output.tables
    write_report(folder, params.settings, params.stated, *files, snakemake.threads)
