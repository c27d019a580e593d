"""What bash and zsh run to complete a line; fish and PowerShell take typer's scripts.

typer's put a blank behind every word. Here a key with its "=" and a folder with its "/" get none, since more
follows; and bash, to which "=" begins another word, completes what follows it, too. Both ask in the form that
typer has for fish: the line up to the cursor, answered by one word a line.
"""

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
