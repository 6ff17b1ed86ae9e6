"""Completion for zsh (5 or newer)."""

import shlex

from palpate.commands.completion.described import Node, Values

FRAME = """\
#compdef palpate
# palpate: completion for zsh; see `palpate completion --help`
_palpate() {{
    local at="" i
    local -a told
    for ((i = 2; i < CURRENT; i++)); do
        case "$at/${{words[i]}}" in
            {known}) at="$at/${{words[i]}}" ;;
            *) break ;;
        esac
    done
    case "$at ${{words[CURRENT - 1]}}" in
{values}
    esac
    case "$at" in
{places}
    esac
}}
if [ "$funcstack[1]" = "_palpate" ]; then
    _palpate "$@"
else
    compdef _palpate palpate
fi
"""


def zsh_script(root: Node) -> str:
    """Return the script."""
    nodes = tuple(root.all())
    values = [
        f"        {shlex.quote(f'{_at(node)} {option.name}')}) {_offer(option.values)}; return ;;"
        for node in nodes
        for option in node.options
        if not option.values.none
    ]
    return FRAME.format(
        known="|".join(_at(node) for node in nodes[1:]),
        values="\n".join(values),
        places="\n".join(_place(node) for node in nodes),
    )


def _at(node: Node) -> str:
    return "".join(f"/{word}" for word in node.words)


def _offer(values: Values) -> str:
    said = [f"compadd -- {' '.join(map(shlex.quote, values.choices))}"] if values.choices else []
    said += ["_files"] if values.files else []
    return "; ".join(said) if said else "_message value"


def _place(node: Node) -> str:
    told = [_described(child.words[-1], child.about) for child in node.children]
    options = [_described(option.name, option.about) for option in node.options]
    lines = [f"        {shlex.quote(_at(node))})"]
    if told:
        lines.append(f"            told=({' '.join(told)}); _describe -t commands command told")
    lines += [f"            {_offer(place)}" for place in node.places if place.choices or place.files]
    lines.append(f"            told=({' '.join(options)}); _describe -o option told")
    return "\n".join([*lines, "            ;;"])


def _described(word: str, about: str) -> str:
    """A word with what is said of it; a colon ends the word, and is escaped in what is said."""
    return shlex.quote(f"{word}:{about}".replace(":", r"\:").replace(r"\:", ":", 1) if about else word)
