"""Configs as nobody should write them, each from a seed: overlays of config/config.yaml with a few things made odd.

    python tests/setup/odd_configs.py 600    plans a run with each of that many, and says which end as they must not

A config that is odd must end in one message or in a plan, within LIMIT seconds.
"""

import argparse
import copy
import random
import sys
import tempfile
import time
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
LIMIT = 10  # s
ODD = (
    *(None, True, False, "", " ", "none", "clean", "all", "null", "*", "../x", "a/b", "{x}", "ü", "x" * 300, "1e9"),
    *("0x10", 0, 1, -1, 2, 3, 7, 1e-9, 0.5, -0.0, 1.5, 100, 10**6, 10**30, -(10**30)),
    *(float("inf"), -float("inf"), float("nan")),
    *([], [[]], [0], [0, 0], [1, "clean"], ["VV", "VV"], ["HV"], [None], [-90, 90], [1e9, 2e9, 2e9], list(range(300))),
    *({}, {"start": 0}, {"start": 0, "stop": 1, "step": 0}, {"start": 9, "stop": 1, "step": 1}, {"count": 3}),
    *({"start": 0, "stop": 1e9, "step": 1e-3}, {"random": []}, {"random": [0, 3]}, {"mesh": "x.stl"}, {"": 1}, {1: 2}),
    *("2026-11-23", "12:30:00", "VV", "xz", ["xz", "yz", "xy"], "sector", "resources/cad/drone.stl", "README.md", "/"),
)


def odd_config(seed):
    """The text of an odd config."""
    rng = random.Random(seed)
    config = {"name": "odd"}
    base = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        path = _path(rng, base)
        inner, value = config, copy.deepcopy(_at(base, path))
        for key in path[:-1]:
            inner = inner.setdefault(key, {})
            if not isinstance(inner, dict):
                break
        else:
            inner.update(_changed(rng, path[-1], value, base))
    text = yaml.safe_dump(
        config, allow_unicode=True, sort_keys=False, default_flow_style=rng.choice((None, False, True))
    )
    return _misspelt(rng, text) if rng.random() < 0.25 else text


def _path(rng, base):
    """The keys that lead to something in the default config, which may be a whole section."""
    path, inner = [], base
    while isinstance(inner, dict) and inner and (not path or rng.random() < 0.85):
        path.append(rng.choice(list(inner)))
        inner = inner[path[-1]]
    return path


def _at(tree, path):
    for key in path:
        tree = tree[key]
    return tree


def _changed(rng, key, value, base):
    """A key and its value, one of them odd."""
    if rng.random() < 0.5:  # of the same kind, and so perhaps right
        if isinstance(value, bool) or value is None:
            return {key: not value}
        if isinstance(value, int | float):
            return {key: type(value)(value * rng.choice((0.3, 0.5, 0.9, 1.1, 2, 3, 10)))}
        if isinstance(value, list):
            return {key: rng.choices(value, k=rng.randrange(1, len(value) + 2)) if value else [0]}
        if isinstance(value, dict) and value:
            return {key: dict.fromkeys(rng.sample(list(value), rng.randrange(1, len(value) + 1)))}
    way = rng.randrange(6)
    if way == 0:  # a key that there is not
        name = str(key)
        at = rng.randrange(len(name) + 1)
        return {name[:at] + rng.choice("x_ é1") + name[at + 1 :]: value}
    if way == 1:  # something that stands elsewhere
        return {key: copy.deepcopy(_at(base, _path(rng, base)))}
    if way == 2 and isinstance(value, int | float):
        return {key: value * rng.choice((-1, 0, 1e-6, 1e3, 1e9))}
    if way == 3 and isinstance(value, list):
        return {key: value[: rng.randrange(len(value) + 1)] + rng.sample(ODD, 1)}
    if way == 4 and isinstance(value, dict) and value:
        return {key: {**value, **dict.fromkeys(rng.sample(list(value), 1), rng.choice(ODD))}}
    return {key: copy.deepcopy(rng.choice(ODD))}


def _misspelt(rng, text):
    """Text with a character lost, put in or doubled, a line moved or cut off."""
    at = rng.randrange(len(text))
    way = rng.randrange(5)
    if way == 0:
        return text[:at] + text[at + 1 :]
    if way == 1:
        return text[:at] + rng.choice("\t:{}[]'\"#&*!%@`|>-,\\\n\0\x07é ") + text[at:]
    if way == 2:
        return text[:at]
    lines = text.splitlines(keepends=True)
    line = rng.randrange(len(lines))
    return "".join([*lines[:line], *([lines[line]] * 2 if way == 3 else [" " + lines[line]]), *lines[line + 1 :]])


def what_is_wrong(status, output, seconds):
    """Why a run with an odd config did not end as it must, in words; nothing if it did."""
    said = [line for line in output.splitlines() if not line.startswith("Using workflow specific profile")]
    if "Traceback" in output or status not in (0, 1, 2):
        return f"a traceback, or status {status}"
    if status and not [line for line in said if "config" in line or "odd.yaml" in line]:
        return "no message on the config"
    if status and len(said) > 3:
        return f"a message of {len(said)} lines"
    return f"{seconds:.0f} s" if seconds > LIMIT else ""


def main():
    sys.path.insert(0, str(ROOT / "tests"))
    from conftest import Project

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("count", type=int)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    options = parser.parse_args()
    wrong = refused = 0
    with tempfile.TemporaryDirectory() as folder:
        project = Project(folder)
        for seed in range(options.first, options.first + options.count):
            project.write("odd.yaml", odd_config(seed))
            start = time.monotonic()
            finished = project.run("report", "--dry-run", "--quiet", "all", "--configfile", "odd.yaml")
            refused += finished.returncode != 0
            said = what_is_wrong(finished.returncode, finished.stdout, time.monotonic() - start)
            if said:
                wrong += 1
                print(f"seed {seed}: {said}\n{finished.stdout[-2000:]}\n", flush=True)
    print(f"{options.count} configs: {refused} refused, {options.count - refused} planned, {wrong} not as they must")
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
