"""``cfmkit new``: the template of a family, a spec to start from, with optional keys as comments."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from cfmkit.cli import options as shell_completion
from cfmkit.cli.options import Common, argument, flag, option
from cfmkit.documents.document import Document, Paragraph, Tone, Verbatim, next_command
from cfmkit.errors import OutputError, UsageError, visible

if TYPE_CHECKING:
    from collections.abc import Iterable

    from cfmkit.cli.output import Terminal
    from cfmkit.specs.keys_and_schema import Key

HELP_POSITION = 50
HELP_EXAMPLE = "cfmkit new cam -o mine.yaml"


@dataclass(frozen=True, kw_only=True)
class NewOptions(Common):
    """Arguments and options."""

    family: str = argument("FAMILY", "A family of mechanisms; `cfmkit show` lists them.", shell_completion.families)
    out: str | None = option("FILE", "File to write, - prints it; default: FAMILY.yaml.", "-o", "--out")
    schema: bool = flag(
        "Also write the JSON schema, and the line through which editors will find it.",
        "--schema/--no-schema",
        default=True,
    )


def run(options: NewOptions, terminal: Terminal) -> Document:
    """Write a commented spec to start from; an existing file is never replaced."""
    from cfmkit.families import family
    from cfmkit.runs.editor_schema import with_line, write_schema
    from cfmkit.store.safe_disk_changes import discard, reporting, write_new

    record = family(options.family)
    text = template(options.family)
    name = f"{options.family}.yaml" if options.out is None else options.out
    if name == "-":
        return Document({"family": options.family, "text": text}, (Verbatim(text),))
    target = Path(name)
    content = with_line(text, record) if options.schema else text
    with reporting(target):
        write_new(target, content.encode())
    names = [name]
    if options.schema:
        try:
            names.append(str(write_schema(target, record)))
        except OutputError:
            discard(target)  # both or none: a second try would find it in its way
            raise
    verb = "design" if record.design else "analyze"
    page = Paragraph("written", ", ".join(map(visible, names)), Tone.GOOD)
    follow = next_command("cfmkit", verb, name)
    return Document({"family": options.family, "file": name, "files": names}, (page, follow))


def template(name: str) -> str:
    """Return the commented spec of a family; it comes with the package that has the family.

    ``{words of PATH}`` in it stands for the words that a key allows. Keys of its blocks that it leaves out are added as
    comments, each with what it means.

    Raises UsageError if there is no such family, or it comes without a template.
    """
    from cfmkit.families import family
    from cfmkit.specs.keys_and_schema import keys

    record = family(name)
    written = record.read("template.yaml")
    if not written:
        raise UsageError(f"the family {name!r} has no template; `cfmkit show {name}` lists its keys")
    allowed_keys = keys(record.spec_type)
    kinds = {key.path: key.kind for key in allowed_keys}
    text = re.sub(r"\{words of (\S+)\}", lambda word: kinds[word[1]].replace(" | ", ", "), written)
    return complete_template(text, allowed_keys)


def complete_template(text: str, allowed_keys: Iterable[Key]) -> str:
    """Return a template with every optional key of its blocks, those that it left out as comments at their ends."""
    for key in allowed_keys:
        block, _, name = key.path.partition(".")
        is_missing = block.isidentifier() and name.isidentifier() and f"{name}:" not in text
        if not is_missing or key.required or (start := re.search(rf"(?m)^{block}:.*\n", text)) is None:
            continue
        after = re.compile(r"(?m)^(?! )").search(text, start.end())  # the first line that is not indented
        end = len(text) if after is None else after.start()
        meaning = key.description.partition(";")[0]
        added = f"  # {name}: {key.default or key.example or f'<{key.kind}>'}    # {meaning}\n"
        text = f"{text[:end]}{added}{text[end:]}"
    return text
