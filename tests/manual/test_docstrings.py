"""Every public name says in a sentence what it is, the units of its numbers, what it refuses."""

from __future__ import annotations

import ast
import functools
import re
from collections.abc import Iterator
from dataclasses import dataclass

from manual.shared_names import one_name_a_line
from manual.subjects import PACKAGES, ROOT, public_names

SENTENCE = re.compile(r"[A-Z`0-9].*[.:]$", re.DOTALL)
VERB = re.compile(
    r"[A-Z]\w+s\b|.*\b(is|are|has|have|can|holds?|says?|tells?|gives?|keeps?|makes?|follows?|shows?"
    r"|was|cannot|runs?|stands?|goes|begins?|hits?|turns?)\b"
)
UNIT = re.compile(
    r"(?<![\w])(m|mm|nm|s|ms|kg|N|J|rad|deg|degrees?|Hz|rpm|MB|SI|inches|seconds|pixels"
    r"|units?|mu|coefficients?|shares?|ratios?|factors?|numbers? of|relative)(?!\w)|[%°]|\(1\)"
)
NUMBERS = re.compile(r"\b(float|NDArray|ndarray|ArrayLike|Array)\b")
CHECKED = re.compile(r"Number\('.")  # the schema's annotation has the unit, and the page shows it


@dataclass(frozen=True)
class Described:
    """A name with its docstring, the names and types of its numbers, and whether it refuses."""

    path: str
    docstring: str
    numbers: tuple[tuple[str, str], ...]
    refuses: bool


@functools.cache
def parsed(module: str) -> ast.Module:
    path = ROOT.joinpath(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(file.read_text(encoding="utf-8"))


def written(module: str, name: str) -> tuple[ast.AST, ast.stmt | None]:
    """The statement that makes a name, and the one after it; follows imports."""
    body = parsed(module).body
    for i, node in enumerate(body):
        after = body[i + 1] if i + 1 < len(body) else None
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            return node, after
        if isinstance(node, ast.Assign | ast.AnnAssign) and name in targets(node):
            return node, after
        if isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                if name == (alias.asname or alias.name):
                    return written(node.module, alias.name)
    raise LookupError(f"{module}.{name}")


def targets(node: ast.Assign | ast.AnnAssign) -> list[str]:
    found = node.targets if isinstance(node, ast.Assign) else [node.target]
    return [target.id for target in found if isinstance(target, ast.Name)]


def text_of(statement: ast.stmt | None) -> str:
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
        return str(statement.value.value)
    return ""


def described() -> Iterator[Described]:
    sources = {n.source: n.path for p in ("", *PACKAGES) for n in public_names(p)}
    for source, path in sources.items():
        node, after = written(*source.rsplit(".", 1))
        if isinstance(node, ast.ClassDef):
            yield from class_described(path, node)
        elif isinstance(node, ast.FunctionDef):
            yield function_described(path, node)
        else:
            yield Described(path, text_of(after), (), False)


def class_described(path: str, node: ast.ClassDef) -> Iterator[Described]:
    docstring, fields = ast.get_docstring(node) or "", []
    attributes = []
    for field, after in zip(node.body, [*node.body[1:], None], strict=True):
        if isinstance(field, ast.AnnAssign) and not targets(field)[0].startswith("_"):
            fields.append((targets(field)[0], ast.unparse(field.annotation)))
            if text_of(after):
                attributes.append(f"    {targets(field)[0]}: {' '.join(text_of(after).split())}")
    own = "\n".join(["", "Attributes:", *attributes]) if attributes else ""
    yield Described(path, docstring + own, tuple(fields), False)
    for method in node.body:
        if isinstance(method, ast.FunctionDef):
            if method.name == "__init__":
                made = function_described(path, method)
                yield Described(path, f"{docstring}\n{made.docstring}", made.numbers, made.refuses)
            elif not method.name.startswith("_"):
                yield function_described(f"{path}.{method.name}", method)


def function_described(path: str, node: ast.FunctionDef) -> Described:
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    numbers = tuple(
        (a.arg, ast.unparse(a.annotation)) for a in arguments if a.annotation is not None
    )
    refuses = any(
        isinstance(part, ast.Raise) and part.exc is not None and "InputError" in ast.dump(part.exc)
        for part in ast.walk(node)
    )
    return Described(path, ast.get_docstring(node) or "", numbers, refuses)


def entries(docstring: str) -> dict[str, str]:
    """Name -> text, of Args and Attributes."""
    found: dict[str, str] = {}
    last = ""
    for line in one_name_a_line(docstring).split("\n"):
        if entry := re.match(r"\s+\**(\w+): (.*)", line):
            last = entry[1]
            found[last] = entry[2]
        elif last and line.startswith("  "):
            found[last] += f" {line.strip()}"
        else:
            last = ""
    return found


def without_unit(found: Described) -> list[str]:
    """The numbers whose unit neither their entry nor a sentence about them says."""
    if re.search(r"\bSI\b", found.docstring):
        return []
    said, missing = entries(found.docstring), []
    for name, annotation in found.numbers:
        if annotation.startswith("Callable") or CHECKED.search(annotation):
            continue
        if NUMBERS.search(annotation):
            about = said.get(name) or re.search(rf"[^.]*`{name}`[^.]*", found.docstring)
            if about is None or not UNIT.search(about if isinstance(about, str) else about[0]):
                missing.append(name)
    return missing


FOUND = list(described())


def test_the_names_are_found():
    assert len({one.path for one in FOUND}) > 400  # with methods


def test_each_begins_with_a_sentence():
    wrong = []
    for one in FOUND:
        paragraph = " ".join(one.docstring.split("\n\n")[0].split())
        first = re.split(r"(?<=[.:]) ", paragraph)[0]
        if not (SENTENCE.match(paragraph) and VERB.match(first)):
            wrong.append(f"{one.path}: {first}")
    assert not wrong


def test_each_number_has_a_unit():
    wrong = {f.path: missing for f in FOUND if (missing := without_unit(f))}
    assert not wrong


def test_each_that_refuses_says_so():
    wrong = [f.path for f in FOUND if f.refuses and "InputError" not in f.docstring]
    assert not wrong
