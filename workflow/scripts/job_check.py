from pathlib import Path

from isarflow.core.job import job
from isarflow.report.selection import in_full
from isarflow.setup.checkup import REFUSED, brief, checkup, swept

with job(snakemake):
    lines, refused = [swept(snakemake.params.settings)], []
    print(lines[0])
    whole = in_full(snakemake.params.settings["targets"])
    for target in snakemake.params.targets:
        found = checkup(snakemake.params.settings, target)
        found = [f"{target}:", *found] if target in whole else brief(target, found)
        print("\n".join(found))
        lines += found
        refused += [target] if any(line.startswith(REFUSED) for line in found) else []
    # With this line the run ends in an error.
    lines += [f"Error: refused: {', '.join(refused)}"] if refused else []
    Path(snakemake.output[0]).write_text("\n".join([*lines, ""]))
