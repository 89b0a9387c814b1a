from pathlib import Path

from core.job import job
from report.page import write_report

with job(snakemake):
    output = snakemake.output
    write_report(Path(output.page).parents[1], snakemake.params.settings, output.page, output.figures, output.tables)
