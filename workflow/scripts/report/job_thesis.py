from pathlib import Path

from core.job import job
from report.thesis_page import write_page

with job(snakemake):
    output, params = snakemake.output.page, snakemake.params
    write_page(Path(output).parents[1], params.settings, params.stated, output)
