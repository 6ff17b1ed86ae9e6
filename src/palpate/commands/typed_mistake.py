"""What people may have meant who typed something that the parser refuses."""

from collections.abc import Mapping, Sequence

from palpate.commands.completion.described import Node, described_command
from palpate.nearest_name import nearest

OTHER_NAMES: Mapping[str, str] = {"--mu": "--friction"}
"""Options as others call them."""


def advice_on_mistake(kind: type, arguments: Sequence[str]) -> str:
    """Return a line on the first mistake that looks like a slip; empty if none does.

    Args:
        kind: Of the command's options.
        arguments: That the parser has refused.
    """
    node = described_command((), "", kind, (), ())
    choices = {option.name: option.values.choices for option in node.options}
    before = ""
    for i, word in enumerate(arguments):
        if word.startswith("--"):
            before, equals, value = word.partition("=")
            before = before.replace("_", "-")  # the parser takes either
            if before not in choices and OTHER_NAMES.get(before) in choices:
                return f"Did you mean {OTHER_NAMES[before]}?"
            said = _on_choice(value, choices.get(before, ())) if equals else ""
        elif i and arguments[i - 1].startswith("--") and "=" not in arguments[i - 1]:
            said = _on_choice(word, choices.get(before, ()))
            if _is_flag(node, before):
                said = _on_word(node, word)
        else:
            said = _on_choice(word, node.places[0].choices) if i == 0 and node.places else _on_word(node, word)
        if said:
            return said
    return ""


def _on_choice(word: str, choices: Sequence[str]) -> str:
    near = None if word in choices else nearest(word, choices)
    return f"Did you mean {near}?" if near else ""


def _on_word(node: Node, word: str) -> str:
    """What to say of a word that follows no option, where nothing but options are taken."""
    if node.places:
        return ""
    for option in node.options:
        if word in option.values.choices:
            return f"Options have names here: did you mean {option.name} {word}?"
    return ""


def _is_flag(node: Node, name: str) -> bool:
    return any(option.name == name and option.values.none for option in node.options)
