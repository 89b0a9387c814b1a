from pathlib import Path

from core.job import job
from setup.checkup import checkup, swept

with job(snakemake):
    lines = [swept(snakemake.params.settings)]
    print(lines[0])
    for target in snakemake.params.targets:
        found = [f"{target}:", *checkup(snakemake.params.settings, target)]
        print("\n".join(found))
        lines += found
    Path(snakemake.output[0]).write_text("\n".join([*lines, ""]))
