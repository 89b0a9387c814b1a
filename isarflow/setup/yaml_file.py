"""Read a config file; of one that is not YAML, say where it is wrong, and what YAML's reader says of it."""

import re
import stat
from argparse import ArgumentParser
from pathlib import Path

import yaml

from isarflow.core.errors import InputError

# Beside libyaml's words for what it cannot read.
ADVICE = (
    ". Look at the brackets, quotes (a path with a \\ in single ones), colons (with a space after them) and "
    "indentation (spaces alone) there and above"
)


def check_command_line(arguments, folder):
    """Exit with one message if --configfile or --config, among a command line's arguments, is not as it must be.

    Snakemake reads these before the Snakefile, and would show a less clear message or a traceback.
    folder: the repository.
    """
    parser = ArgumentParser(add_help=False, allow_abbrev=False)
    parser.add_argument("--configfile", "--configfiles", nargs="+", default=[], dest="files", action="extend")
    parser.add_argument("--config", "-C", nargs="*", default=[], dest="settings", action="extend")
    given = parser.parse_known_args(arguments)[0]
    try:
        if set("{}") & set(str(folder)):
            raise InputError(f"{folder}: Snakemake takes braces in a path for wildcards; move the repository.")
        for path in given.files:
            read_yaml(path)
        for setting in given.settings:
            if not re.match(r"[A-Za-z_]\w*=", setting):
                form = "key=value with a key of the config's first level, as name=mine or 'radar={frequencies: 7}'"
                raise InputError(f"--config {setting}: write {form}, in quotes if there are spaces in it.")
    except InputError as error:
        raise SystemExit(str(error)) from None


def read_yaml(path):
    """A config file, YAML or JSON, as a mapping of plain types.

    Raises InputError, with the file, line and column, for a file that is missing or no mapping, for bad syntax, and for
    a key that occurs twice in a mapping.
    """
    text = _text(Path(path))
    try:
        content = _parsed(text)
    except yaml.MarkedYAMLError as error:
        began = f"{error.context} that begins in {_place(error.context_mark)}: " if error.context_mark else ""
        advice = "" if isinstance(error, yaml.constructor.ConstructorError) else ADVICE
        raise InputError(f"{path}, {_place(error.problem_mark)}: {began}{error.problem}{advice}.") from None
    except RecursionError:
        raise InputError(f"{path}: its brackets stand in one another more than a thousand deep.") from None
    except (yaml.YAMLError, ValueError) as error:
        raise InputError(f"{path}: {' '.join(str(error).split())}.") from None
    if not isinstance(content, dict):
        kind = {type(None): "is empty", list: "holds a list"}.get(type(content), f"holds {content!r} alone")
        raise InputError(f"{path} {kind}; a config is keys with values, as in 'name: mine'.")
    return content


def _text(path):
    try:
        if path.exists() and not (stat.S_ISREG(path.stat().st_mode) or path.is_dir()):
            raise InputError(f"{path}: Snakemake reads a config more than once, and this is no file; write it to one.")
        return path.read_text("utf-8-sig")
    except FileNotFoundError:
        hint = "" if path.suffix else f" If '{path}' is what to make, it stands before --configfile."
        raise InputError(f"{path}: there is no such config file (in {Path.cwd()}).{hint}") from None
    except OSError as error:
        raise InputError(f"{path}: not a config file that can be read: {error.strerror}.") from None
    except UnicodeDecodeError as error:
        line, byte = error.object[: error.start].count(b"\n") + 1, f"byte 0x{error.object[error.start]:02x}"
        raise InputError(f"{path}, line {line}: not text in UTF-8 ({byte}); save the file as UTF-8.") from None


def _parsed(text):
    """What YAML, or JSON, which is YAML too, says."""
    loader = _UniqueKeys(text)
    try:
        tree = loader.get_single_node()
        # Snakemake's reader of YAML allows tabs in fewer places than libyaml; it reads JSON by another one.
        if "\t" in text and not text.lstrip().startswith("{"):
            yaml.compose(text, yaml.SafeLoader)
        return loader.construct_object(tree, deep=True) if tree else None
    finally:
        loader.dispose()


class _UniqueKeys(yaml.CSafeLoader):
    """A loader that refuses repeated keys: in YAML a later key replaces an earlier one without a word."""

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                self._refuse(key, "a key must be a word, not a list or a mapping")
            if key.value in seen:
                self._refuse(key, f"the key '{key.value}' stands twice in one mapping")
            seen.add(key.value)
        return super().construct_mapping(node, deep)

    def _refuse(self, key, problem):
        raise yaml.constructor.ConstructorError(None, None, problem, key.start_mark)


def _place(mark):
    return f"line {mark.line + 1}, column {mark.column + 1}"
