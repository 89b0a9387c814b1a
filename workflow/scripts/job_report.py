from pathlib import Path

from isarflow.core.job import job
from isarflow.report.page import write_report

with job(snakemake):
    page, params = snakemake.output.page, snakemake.params
    write_report(Path(page).parents[1], params.settings, params.stated, page, snakemake.threads)
