from pathlib import Path

from isarflow.core.job import job
from isarflow.report.rcs import write_rcs

with job(snakemake):
    page = snakemake.output.page
    write_rcs(Path(page).parents[1], snakemake.params.settings, page)
