"""Counts in words, as logs, `snakemake check` and the page say them."""


def counted(counts):
    """Write a mapping of things to their numbers as '3 merged vertices, 1 united solid'; '' if there are none."""
    named = ((count, key.replace("_", " ")) for key, count in counts.items() if count)
    return ", ".join(f"{count:,} {_one(name) if count == 1 else name}" for count, name in named)


def _one(name):
    return f"{name.removesuffix('vertices')}vertex" if name.endswith("vertices") else name.removesuffix("s")
