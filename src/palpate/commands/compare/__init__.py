"""`palpate compare`: a map against a reference mesh, or runs side by side; imports nothing heavy."""

from dataclasses import fields

from palpate.commands.command_result import CommandResult
from palpate.commands.compare.config import CompareConfig
from palpate.errors import InvalidValueError

OPTIONS_OF_MAPS = ("map_unit", "reference_unit", "within", "region", "align", "samples")
"""Options that do not apply to runs."""


def run_compare(config: CompareConfig) -> CommandResult:
    """Compare what the arguments name, print the metrics, and write the report.

    Raises:
        InvalidValueError: If a file is missing, cannot be read, or does not fit the other.
        OSError: If the report cannot be written.
    """
    places = (config.map, config.reference, *config.others)
    if not any(place.is_dir() or place.suffix == ".mcap" for place in places):
        if config.others:
            raise InvalidValueError(
                f"{config.others[0]}: a map is compared with one mesh; leave it out, or name runs"
            )
        from palpate.commands.compare.maps import compare_map  # kernels, meshes and figures take seconds to import

        return compare_map(config)
    given = [
        f"--{each.name.replace('_', '-')}"
        for each in fields(config)
        if each.name in OPTIONS_OF_MAPS and getattr(config, each.name) != each.default
    ]
    if given:
        raise InvalidValueError(
            f"{', '.join(given)}: for a map and a mesh; runs take --out alone, leave the rest out"
        )
    from palpate.commands.compare.runs import compare_runs

    return compare_runs(places, config.out, config.figures)
