"""Loads a model file with Drake's parser: packages, relative places, errors in words."""

from __future__ import annotations

import contextlib
import logging
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from pydrake.multibody.parsing import (
    LoadModelDirectives,
    ModelDirectives,
    PackageMap,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_racket.io.errors import InputError, one_line
from drake_racket.io.shipped import add_to_package_map
from drake_racket.limbs.files.ties import without_idle
from drake_racket.limbs.left_out import short_list

DIRECTIVES = (".dmd.yaml", ".dmd.yml")
_PACKAGE = re.compile(r"package://([^/\"'<>\s]+)/")


@dataclass(frozen=True)
class Loaded:
    """Holds one file that a parser read, and the models that it gave."""

    path: Path
    instances: tuple[ModelInstanceIndex, ...]
    notes: tuple[str, ...] = ()


@contextlib.contextmanager
def gathered_warnings() -> Iterator[dict[str, int]]:
    """Keeps what Drake warns of while it parses, each text once and how often, from the console."""
    found: dict[str, int] = {}

    def keep(record: logging.LogRecord) -> bool:
        text = one_line(re.sub(r"^.*?:\d+: warning: ", "", record.getMessage()), 120)
        found[text] = found.get(text, 0) + 1
        return False

    logger = logging.getLogger("drake")
    logger.addFilter(keep)
    try:
        yield found
    finally:
        logger.removeFilter(keep)


def load_files(
    plant: MultibodyPlant, path: Path, packages: Mapping[str, str | Path]
) -> list[Loaded]:
    """Adds the models of an SDF, URDF or directives file to the plant.

    Args:
        packages: name -> folder, for `package://name/`. A folder above the file that has the
            package's name, or a package.xml with it, is found by itself.

    Raises:
        InputError: a folder that is none, or a file that Drake cannot read or parse.

    """
    with gathered_warnings() as warned:
        loaded = _load(plant, path, packages)
    if warned:
        said = "; ".join(f"{count} x {text}" for text, count in list(warned.items())[:3])
        more = f"; ... ({len(warned)} kinds)" if len(warned) > 3 else ""
        note = f"Drake warns of {path.name}: {said}{more}"
        loaded[0] = replace(loaded[0], notes=(*loaded[0].notes, note))
    return loaded


def _load(plant: MultibodyPlant, path: Path, packages: Mapping[str, str | Path]) -> list[Loaded]:
    parser = Parser(plant)
    _add_packages(parser.package_map(), path, packages)
    try:
        if path.name.lower().endswith(DIRECTIVES):
            return _directives(parser, path)
        text = path.read_text(encoding="utf-8-sig")
        idle: list[str] = []
        if path.suffix.lower() == ".urdf":
            text, idle = without_idle(text)
        # Drake goes by the suffix as it is written
        if path.suffix in (".sdf", ".urdf") and not idle:
            return [Loaded(path, tuple(parser.AddModels(str(path))))]
        added = parser.AddModelsFromString(text, path.suffix.lower().removeprefix("."))
        notes = (
            f"mimic and transmission elements without effect, passed over: {short_list(idle, 4)}",
        )
        return [Loaded(path, tuple(added), notes if idle else ())]
    except (RuntimeError, UnicodeDecodeError) as error:
        raise InputError("limb: model", path, _in_words(str(error))) from None


def _directives(parser: Parser, path: Path) -> list[Loaded]:
    directives = _resolved(path)
    files = {
        item.add_model.name: _local(parser, item.add_model.file)
        for item in directives.directives
        if item.add_model is not None
    }
    plant = parser.plant()
    found = []
    for info in ProcessModelDirectives(directives, parser):
        name = plant.GetModelInstanceName(info.model_instance)
        found.append(Loaded(files.get(name) or path, (info.model_instance,)))
    return found


def _resolved(path: Path) -> ModelDirectives:
    """The directives of a file, and of those it includes, with their files' places in full.

    A file without a scheme is relative to its directives' own folder; Drake takes none.
    """
    directives = LoadModelDirectives(str(path))
    whole = []
    for item in directives.directives:
        for part in (item.add_model, item.add_directives):
            if part is None or "://" in part.file:
                continue
            place = path.parent / part.file.removeprefix("file:")
            if not place.is_file():
                raise InputError("limb: model", str(part.file), f"a file that is there ({place})")
            part.file = f"file://{place.resolve()}"
        inner = item.add_directives
        if inner is not None and inner.file.startswith("file://") and not inner.model_namespace:
            whole += _resolved(Path(inner.file.removeprefix("file://"))).directives
        else:
            whole.append(item)
    directives.directives = whole
    return directives


def _local(parser: Parser, uri: str) -> Path | None:
    """The file that a URI stands for; None for one that is not known here."""
    if uri.startswith("file://"):
        return Path(uri.removeprefix("file://"))
    found = _PACKAGE.match(uri)
    if found and parser.package_map().Contains(found[1]):
        return Path(parser.package_map().GetPath(found[1])) / uri[found.end() :]
    return None


def _add_packages(known: PackageMap, path: Path, packages: Mapping[str, str | Path]) -> None:
    add_to_package_map(known)
    for name, folder in packages.items():
        if not Path(folder).is_dir():
            raise InputError(f"limb: packages.{name}", Path(folder), "a folder that is there")
        if not known.Contains(name):
            known.Add(name, str(Path(folder).resolve()))
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(
            "limb: model", path, f"a file that can be read ({error.strerror})"
        ) from None
    for name in dict.fromkeys(_PACKAGE.findall(text)):
        if known.Contains(name):
            continue
        for folder in path.resolve().parents:
            named = folder.name == name or _package_name(folder) == name
            inside = folder / name
            if named or inside.is_dir():
                known.Add(name, str(folder if named else inside))
                break


def _package_name(folder: Path) -> str:
    try:
        text = (folder / "package.xml").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    found = re.search(r"<name>\s*([^<\s]+)\s*</name>", text)
    return found[1] if found else ""


_WORDS = (
    (
        re.compile(r"refers to unknown package '([^']+)'"),
        "a file whose packages are known: packages: {{{0}: FOLDER}}",
    ),
    (
        re.compile(r"already contains a (body|joint|frame) named '([^']+)'"),
        "a model with names of its own: it has two of the {0} {1}",
    ),
    (
        re.compile(r"Could not find link named '([^']+)'.*element '([^']+)'"),
        "a model that has every link it names: joint {1} asks for the link {0}",
    ),
    (
        re.compile(r"XML_ERROR|Error reading element|not well-formed"),
        "well-formed XML",
    ),
)


def _in_words(message: str) -> str:
    """What to do about a message of Drake's, and the message."""
    lines = [line for line in message.strip().splitlines() if line.strip()] or ["no reason given"]
    reason = one_line(lines[0], 240)
    for pattern, text in _WORDS:
        if found := pattern.search(message):
            groups = [group for group in found.groups() if group]
            return f"{text.format(*groups)} ({reason})"
    return f"a model that Drake can parse ({reason})"
