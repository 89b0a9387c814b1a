"""What the jobs of a run took, as Snakemake recorded it."""

import pandas as pd


def seconds(folder, named):
    """Return the seconds of each job in a folder of records, of those of a stage for a target or a run that is `named`.

    Columns stage, step, job and s. May be empty.
    """
    rows = []
    for path in sorted(folder.glob("*/**/*.tsv")):
        stage, *job = path.relative_to(folder).with_suffix("").parts
        step, *job = job if stage == "learning" else [stage, *job]
        # Solves stand in a folder of their own, <target>-<band>: a target's name may hold hyphens, too.
        whose = job[1].rpartition("-")[0] if job[:1] == ["bands"] else "".join(job[:1])
        if not job or whose in named:
            rows.append((stage, step, "/".join(job), pd.read_csv(path, sep="\t", na_values="-").iloc[-1]["s"]))
    return pd.DataFrame(rows, columns=["stage", "step", "job", "s"])
