from pathlib import Path

from isarflow.core.job import job
from isarflow.report.thesis_page import write_page

with job(snakemake):
    output, params = snakemake.output.page, snakemake.params
    write_page(Path(output).parents[1], params.settings, params.stated, output)
