"""Completion for fish (3 or newer)."""

from palpate.commands.completion.described import Node, Values

HEAD = """\
# palpate: completion for fish; see `palpate completion --help`
function __palpate_words
    for word in (commandline -opc)[2..-1]
        string match -q -- '-*' $word; and break
        echo $word
    end
end
function __palpate_at  # the command line begins with these words
    set -l typed (__palpate_words)
    test (count $typed) -ge (count $argv); or return 1
    test (count $argv) -eq 0; and return
    set -l begun $typed[1..(count $argv)]
    test "$begun" = "$argv"
end
function __palpate_only  # it has these words and no further ones yet
    test (count (__palpate_words)) -eq (count $argv); and __palpate_at $argv
end
complete -c palpate -f
"""


def fish_script(root: Node) -> str:
    """Return the script."""
    lines = [line for node in root.all() for line in _lines(node)]
    return HEAD + "\n".join(lines) + "\n"


def _lines(node: Node) -> list[str]:
    here = " ".join(("__palpate_at", *node.words))
    only = " ".join(("__palpate_only", *node.words))
    lines = [
        f"complete -c palpate -n {_quoted(only)} -a {_quoted(child.words[-1])} -d {_quoted(child.about)}"
        for child in node.children
    ]
    lines += [
        f"complete -c palpate -n {_quoted(here)}{_offer(place)}"
        for place in node.places
        if place.choices or place.files
    ]
    # options of the program itself stand before any command
    where = here if node.words and not node.children else only
    for option in node.options:
        follows = "" if option.values.none else _asks(option.values)
        about = f" -d {_quoted(option.about)}" if option.about else ""
        lines.append(f"complete -c palpate -n {_quoted(where)} -l {option.name[2:]}{follows}{about}")
    return lines


def _offer(values: Values) -> str:
    files = " -F" if values.files else ""
    return files + (f" -a {_quoted(' '.join(values.choices))}" if values.choices else "")


def _asks(values: Values) -> str:
    return " -r" + _offer(values) if values.files else " -x" + _offer(values)


def _quoted(text: str) -> str:
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"
