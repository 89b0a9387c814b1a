import sys
from pathlib import Path

from isarflow.core.job import job

with job(snakemake):
    sys.path.insert(0, snakemake.scriptdir)
    from study.page import write_page

    output, params = snakemake.output.page, snakemake.params
    write_page(Path(output).parents[1], params.settings, params.stated, output)
