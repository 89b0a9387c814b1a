from pathlib import Path

from isarflow.core.job import job
from isarflow.report.rcs import write_rcs

with job(snakemake):
    output, settings = snakemake.output, snakemake.params.settings
    tables = {Path(path).stem: path for path in output.samples}
    write_rcs(Path(output.page).parents[1], settings, output.page, tables, (output.figures, output.tables))
