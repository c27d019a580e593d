"""Verbs as commands of typer, imported when needed, with options read off dataclasses; parsing of arguments."""

from __future__ import annotations

import dataclasses
import inspect
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer
from typer.core import TyperGroup

from cfmkit.cli import verbs
from cfmkit.cli.options import Common
from cfmkit.cli.verbs import names
from cfmkit.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from cfmkit.cli.output import Terminal
    from cfmkit.documents.document import Document

_TYPER_OPTIONS: dict[str, Any] = {
    "rich_markup_mode": "rich",
    "context_settings": {"help_option_names": ["-h", "--help"]},
    "add_completion": False,
    "pretty_exceptions_enable": False,
}
PLAIN_TYPES = (str, int, bool)  # types of options whose values need no conversion


@dataclass(frozen=True)
class Call:
    """A command line that was understood: what to call, and with which options."""

    run: Callable[[Any, Terminal], Document]
    options: Common


class Verbs(TyperGroup):
    """The group of all verbs; each module is imported when its command is called."""

    lists_verbs = False  # whether commands are made for their names and first sentences alone

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all verbs, in the order of the help."""
        return sorted(names(), key=lambda name: _import_verb(name).HELP_POSITION)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return one verb as a command, None if there is no such verb."""
        return _make_command(cmd_name, self.lists_verbs) if cmd_name in names() else None

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the list of verbs, whose own options it does without: those of some need a second of imports."""
        self.lists_verbs = True
        try:
            super().format_help(ctx, formatter)
        finally:
            self.lists_verbs = False

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Find the verb that the arguments begin with."""
        if args and args[0] not in names() and not args[0].startswith("-") and not ctx.resilient_parsing:
            ctx.fail(_describe_unknown(args[0]))
        return super().resolve_command(ctx, args)


def _describe_unknown(name: str) -> str:
    from cfmkit.specs.yamlio import did_you_mean

    hint = did_you_mean(name, names()) or f"there are {', '.join(sorted(names()))}"
    return f"there is no command {name!r}; {hint}"


def _import_verb(name: str) -> ModuleType:
    return import_module(f"{verbs.__name__}.{name.replace('-', '_')}")


def _find_options_class(module: ModuleType) -> Any:
    """Return the class of the options that the `run` of a verb takes."""
    if hasattr(module, "make_options"):
        return module.make_options()
    return vars(module)[module.run.__annotations__["options"]]


def _make_command(name: str, is_listed: bool) -> Any:
    """Return the command of a verb: its options are the fields of what its `run` takes, if it is not only listed."""
    module = _import_verb(name)
    options = Common if is_listed else _find_options_class(module)

    def callback(**values: Any) -> Call:
        return Call(module.run, options(**values))

    hints = get_type_hints(options)
    fields = dataclasses.fields(options)
    shared = {field.name for field in dataclasses.fields(Common)}  # by all verbs: these come last in the help
    parameters = [
        _parameter(field, hints[field.name]) for field in sorted(fields, key=lambda field: field.name in shared)
    ]
    callback.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    callback.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    app = typer.Typer(**_TYPER_OPTIONS)
    example = f"Example: {module.HELP_EXAMPLE}" if hasattr(module, "HELP_EXAMPLE") else None
    app.command(name, help=_unwrap_paragraphs(inspect.getdoc(module.run) or ""), epilog=example)(callback)
    return _hide_types_in_help(typer.main.get_command(app))


def _unwrap_paragraphs(text: str) -> str:
    """Return a docstring with one line for each paragraph: typer keeps the ends of lines of all but the first.

    Examples
    --------
    >>> _unwrap_paragraphs("What it does.\\n\\nMore of it,\\nand the end.")
    'What it does.\\n\\nMore of it, and the end.'
    """
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _hide_types_in_help(command: Any) -> Any:
    """Return a command whose help names no types of Python: neither ``<bool>`` of a flag nor ``<str>`` of a file."""
    helped = command.get_help_option

    def help_option(ctx: Any) -> Any:
        option = _hide_type(helped(ctx))
        _convert_if_given(option)
        return option

    command.get_help_option = help_option
    for item in command.params:
        _convert_if_given(_hide_type(item))
    return command


def _convert_if_given(item: Any) -> None:
    """Let an option be as it is that is not given or of its type: to convert it typer makes a validator for each."""
    convert, several = item.process_value, item.nargs == -1 or getattr(item, "multiple", False)
    kind = getattr(getattr(item, "type_descriptor", None), "annotation", None)  # older versions of typer have none

    def process_value(ctx: Any, value: Any) -> Any:
        is_given = value is not None or item.required
        if is_given and not (kind in PLAIN_TYPES and type(value) is kind):
            return convert(ctx, value)
        value = value if is_given else () if several else None
        return value if item.callback is None else item.callback(ctx, item, value)

    item.process_value = process_value


def _hide_type(item: Any) -> Any:
    if getattr(item, "is_flag", False) or getattr(item, "count", False):
        item.metavar = ""
    elif getattr(item, "param_type_name", "") == "argument":
        item.display_type_rich = lambda ctx: None  # its name says it; older versions of typer do not call this
        if item.required:  # SPEC and not {SPEC}, as older versions have it
            item._usage_display_name = lambda: item.display_name_raw + ("" if item.nargs == 1 else "...")
    return item


def _parameter(field: dataclasses.Field[Any], hint: Any) -> inspect.Parameter:
    """Return what typer makes an option or argument of."""
    names = field.metadata.get("names", ())
    if "names" in field.metadata and not names:
        names = (f"--{field.name.replace('_', '-')}",)
    default = inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
    annotation = Annotated[hint, field.metadata["declare"](*names)]
    return inspect.Parameter(field.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


OPTIONAL_VALUE_OPTIONS = ("--figure",)
"""Options whose value may be left out; typer has none of that kind, so an empty value is written for it."""


def _spell_out_empty_values(arguments: list[str]) -> list[str]:
    """Return arguments with an empty value where one is left out.

    Examples
    --------
    >>> _spell_out_empty_values(["show", "--figure", "--json"])
    ['show', '--figure=', '--json']
    """
    followed = zip(arguments, [*arguments[1:], "-"], strict=False)
    return [
        f"{option}=" if option in OPTIONAL_VALUE_OPTIONS and after.startswith("-") else option
        for option, after in followed
    ]


def parse(app: typer.Typer, arguments: list[str]) -> Call | None:
    """Return what a command line asks for; None if the parser answered it itself (``--help``).

    Raises Exception of typer's kind, if it is malformed.
    """
    try:
        call = _hide_types_in_help(typer.main.get_command(app)).main(
            _spell_out_empty_values(arguments), "cfmkit", standalone_mode=False
        )
    except SystemExit:
        # The reader of the help text has left, or typer has answered a shell.
        return None
    if call == 1:  # of a shell that typer does not know
        raise UsageError("there is a completion for bash, zsh, fish and PowerShell; run this in one of them")
    return call if isinstance(call, Call) else None


def program(callback: Callable[..., Any], text: str, epilog: str) -> typer.Typer:
    """Return the program: the group of all verbs, with what stands before them as `callback`."""
    app = typer.Typer(cls=Verbs, **{**_TYPER_OPTIONS, "add_completion": True})
    app.callback(invoke_without_command=True, help=text, epilog=epilog)(callback)
    return app
