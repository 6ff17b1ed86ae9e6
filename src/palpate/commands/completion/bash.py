"""Completion for bash (4 or newer)."""

import shlex
from collections import defaultdict

from palpate.commands.completion.described import Node, Values

FRAME = """\
# palpate: completion for bash; see `palpate completion --help`
_palpate() {{
    local cur="${{COMP_WORDS[COMP_CWORD]}}" prev="${{COMP_WORDS[COMP_CWORD - 1]}}" at="" i words="" files=""
    if [[ $cur == "=" ]]; then  # --option=
        cur=""
    elif [[ $prev == "=" ]]; then
        prev="${{COMP_WORDS[COMP_CWORD - 2]}}"
    fi
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "$at/${{COMP_WORDS[i]}}" in
            {known}) at="$at/${{COMP_WORDS[i]}}" ;;
            *) break ;;
        esac
    done
    COMPREPLY=()
    case "$at $prev" in
{values}
        *)
            case "$at" in
{places}
            esac
            ;;
    esac
    COMPREPLY=($(compgen -W "$words" -- "$cur"))
    if [[ -n $files && $cur != -* ]]; then
        compopt -o filenames 2>/dev/null
        local IFS=$'\\n'
        COMPREPLY+=($(compgen -f -- "$cur"))
    fi
}}
complete -F _palpate palpate
"""


def bash_script(root: Node) -> str:
    """Return the script."""
    nodes = tuple(root.all())
    known = "|".join(_at(node) for node in nodes[1:])
    followed: defaultdict[Values, list[str]] = defaultdict(list)
    for node in nodes:
        for option in node.options:
            if not option.values.none:
                followed[option.values].append(shlex.quote(f"{_at(node)} {option.name}"))
    values = "\n".join(
        f"        {'|'.join(cases)})\n            {_set(' '.join(kind.choices), kind.files)}\n            ;;"
        for kind, cases in followed.items()
    )
    places = "\n".join(
        f"                {shlex.quote(_at(node))}) {_set(_words(node), _takes_files(node))} ;;" for node in nodes
    )
    return FRAME.format(known=known, values=values, places=places)


def _at(node: Node) -> str:
    return "".join(f"/{word}" for word in node.words)


def _words(node: Node) -> str:
    """All that may stand where no option asks for a value."""
    names = [child.words[-1] for child in node.children]
    names += [choice for place in node.places for choice in place.choices]
    return " ".join([*names, *(option.name for option in node.options)])


def _takes_files(node: Node) -> bool:
    return any(place.files for place in node.places)


def _set(words: str, files: bool) -> str:
    said = f"words={shlex.quote(words)}"
    return f"{said}; files=yes" if files else said
