"""Completion in a shell: names of families and topics, files with specifications or data, and the script that asks.

bash and zsh run the scripts below; fish and PowerShell take typer's. Typer's for bash and zsh put a blank behind every
word. Here a key with its "=" and a folder with its "/" get none, since more follows; and bash, to which "=" begins
another word, completes what follows it, too. Both ask in the form that typer has for fish: the line up to the cursor,
answered by one word a line.
"""

from __future__ import annotations

import os
from typing import Any

import typer

SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")
"""Those that typer has scripts for."""

LARGEST_HEAD = 20_000
"""Characters of a file in which its family is looked for; a completion that reads more would be felt."""

BASH = r"""
_cfmkit_completion() {
    local IFS=$'\n' line=${COMP_LINE:0:COMP_POINT}
    local word=${line##*[[:space:]]}
    COMPREPLY=( $(env _CFMKIT_COMPLETE=complete_fish _TYPER_COMPLETE_FISH_ACTION=get-args \
                      _TYPER_COMPLETE_ARGS="$line" "$1" | cut -f 1) )
    # bash replaces only what stands behind the last "="
    if [[ $word == *=* && $COMP_WORDBREAKS == *=* ]]; then
        COMPREPLY=( "${COMPREPLY[@]#"${word%=*}="}" )
    fi
    if [[ ${#COMPREPLY[@]} == 1 && ${COMPREPLY[0]} == *[=/] ]]; then compopt -o nospace; fi
}

complete -o default -F _cfmkit_completion cfmkit
""".strip()

ZSH = r"""
#compdef cfmkit

_cfmkit_completion() {
    local -a found open closed
    found=( ${(f)"$(env _CFMKIT_COMPLETE=complete_fish _TYPER_COMPLETE_FISH_ACTION=get-args \
                        _TYPER_COMPLETE_ARGS="${words[1,$CURRENT]}" cfmkit)"} )
    if (( ! $#found )); then _files; return; fi
    found=( "${(@)found//:/\\:}" )
    open=( "${(@M)found:#*[=/]}" )
    closed=( "${(@)found:#*[=/]}" )
    closed=( "${(@)closed/$'\t'/:}" )  # what a tab separates is the help of a word
    (( $#open )) && _describe "more follows" open -S ""
    (( $#closed )) && _describe "words" closed
}

# installed, this file is the function that the first TAB calls; else it is read by `source` or `eval`
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then
    compdef _cfmkit_completion cfmkit
    _cfmkit_completion "$@"
else
    compdef _cfmkit_completion cfmkit
fi
""".strip()

SCRIPTS = {"bash": BASH, "zsh": ZSH}
"""What bash and zsh run to complete a line."""


def shells(incomplete: str) -> list[str]:
    """Return the names of shells that begin with the text typed so far."""
    return [name for name in SHELLS if name.startswith(incomplete)]


def show(ctx: typer.Context, param: typer.CallbackParam, value: str | None) -> None:
    """Print the script of a shell and exit; default (an empty value): of the current shell."""
    if value is None or ctx.resilient_parsing:
        return
    shell = _shell(value)
    if shell in SCRIPTS:
        typer.echo(SCRIPTS[shell])
        raise typer.Exit
    typer.completion.show_callback(ctx, param, shell)


def install(ctx: typer.Context, param: typer.CallbackParam, value: str | None) -> None:
    """Install the script of a shell and exit; default (an empty value): of the current shell."""
    if value is None or ctx.resilient_parsing:
        return
    try:
        shell, place = typer.completion.install(_shell(value), prog_name="cfmkit")  # type: ignore[attr-defined]
    except FileNotFoundError as error:  # the profile of a PowerShell is where it says
        raise typer.BadParameter(f"the program {value or 'pwsh'!r} was not found: its profile is not known") from error
    if shell in SCRIPTS:
        place.write_text(f"{SCRIPTS[shell]}\n", encoding="utf-8")
    typer.echo(f"{shell} completion installed in {place}; it takes effect in a new terminal")
    raise typer.Exit


def _shell(named: str) -> str:
    """Return the shell that is named, or the current one."""
    import shellingham

    if not named:
        try:
            named = shellingham.detect_shell()[0]
        except shellingham.ShellDetectionFailure:
            raise typer.BadParameter(f"the current shell is not a known one; name one: {', '.join(SHELLS)}") from None
    if named not in SHELLS:
        raise typer.BadParameter(f"there is no completion for {named!r}; there is one for {', '.join(SHELLS)}")
    return named


def families(incomplete: str) -> list[str]:
    """Return the names of families that begin with the text typed so far."""
    from cfmkit.families import names

    return [name for name in names() if name.startswith(incomplete)]


def topics(incomplete: str) -> list[str]:
    """Return what `cfmkit show` explains and begins so: topics, families, and everything else that has a name."""
    from cfmkit.cli.show_topics import TOPICS, names

    known = [*TOPICS, *families("")]
    # names by the hundred only once somebody has begun one
    every = [*known, *names()] if incomplete else known
    return list(dict.fromkeys(name for name in every if name.startswith(incomplete)))


def changes(ctx: Any, incomplete: str) -> list[str]:
    """Return what ``--set`` may begin with: keys of the family of the specification that was named, or of all.

    Items of lists are completed with the number of the first.
    """
    from cfmkit import families
    from cfmkit.specs.keys_and_schema import keys

    path, equals, _ = incomplete.partition("=")
    records = [families.family(name) for name in _families_named(ctx)]
    known = {key.path.replace("[]", ".0"): key for record in records for key in keys(record.spec_type)}
    if equals:
        words = known[path].kind.split(" | ") if path in known and " | " in known[path].kind else []
        return [f"{path}={word}" for word in words if f"{path}={word}".startswith(incomplete)]
    found = [path for path in known if path.startswith(incomplete) and known[path].kind != "block"]
    # one level at a time would save no key press: names below a block are few
    return [f"{path}=" for path in found]


def _families_named(ctx: Any) -> list[str]:
    """Return the family of the specification on the command line; all of them where there is none to be read."""
    from cfmkit import families

    named = [ctx.params.get("spec"), *(ctx.params.get("specs") or ())]
    found = []
    for name in filter(None, named):
        try:
            with open(name, encoding="utf-8") as file:
                lines = file.read(LARGEST_HEAD).splitlines()
        except (OSError, UnicodeDecodeError):
            continue
        found += [line.partition(":")[2].split("#")[0].strip() for line in lines if line.startswith("family:")]
    known = families.names()
    return [name for name in found if name in known] or list(known)


def specs(incomplete: str) -> list[str]:
    """Return the YAML files, and the folders on the way to more, whose paths begin so."""
    return _files(incomplete, (".yaml", ".yml"))


def tables(incomplete: str) -> list[str]:
    """Return the CSV files, and the folders on the way to more, whose paths begin so."""
    return _files(incomplete, (".csv",))


def _files(incomplete: str, endings: tuple[str, ...]) -> list[str]:
    folder, begun = os.path.split(incomplete)
    try:
        entries = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return []
    shown = [entry for entry in entries if entry.name.startswith(begun) and begun[:1] == entry.name[:1] == "."]
    shown = shown or [entry for entry in entries if entry.name.startswith(begun) and not entry.name.startswith(".")]
    wanted = [entry for entry in shown if entry.is_dir() or entry.name.lower().endswith(endings)]
    return [os.path.join(folder, entry.name) + ("/" if entry.is_dir() else "") for entry in wanted]
