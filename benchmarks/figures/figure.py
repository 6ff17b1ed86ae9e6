"""One figure, and the file that keeps those measured last."""

import csv
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

FILE = Path(__file__).resolve().parents[1] / "figures.csv"
HISTORY = FILE.with_name("history.csv")


@dataclass(frozen=True, slots=True)
class Figure:
    """A figure as it was measured.

    Attributes:
        name: By which tables ask for it.
        value: In its unit.
        unit: "" for a ratio or a count.
        asked: What it should be, as words; "" where nothing was asked.
        means: What it is.
    """

    name: str
    value: float
    unit: str
    asked: str
    means: str

    @property
    def row(self) -> tuple[str, ...]:
        """As the file has it: three digits are what two shared cores are good for."""
        return self.name, f"{self.value:.3g}", self.unit, self.asked, self.means


@dataclass(frozen=True, slots=True)
class Measured:
    """All figures of one run of `make figures`.

    Attributes:
        date: Of the run.
        machine: Where.
        version: Of palpate.
        figures: By name.
    """

    date: str
    machine: str
    version: str
    figures: dict[str, Figure]

    def write(self, path: Path = FILE) -> None:
        """Write the file anew."""
        with path.open("w", newline="", encoding="utf-8") as file:
            table = csv.writer(file, lineterminator="\n")
            table.writerow(("date", self.date))
            table.writerow(("machine", self.machine))
            table.writerow(("version", self.version))
            table.writerow(("name", "value", "unit", "asked", "means"))
            table.writerows(figure.row for figure in self.figures.values())


def read(path: Path = FILE) -> Measured:
    """Return what `Measured.write` wrote."""
    with path.open(newline="", encoding="utf-8") as file:
        (_, date), (_, machine), (_, version), _, *rows = csv.reader(file)
    return Measured(date, machine, version, by_name(Figure(a, float(b), c, d, e) for a, b, c, d, e in rows))


def by_name(figures: Iterable[Figure]) -> dict[str, Figure]:
    """Return figures by their names."""
    return {figure.name: figure for figure in figures}


def write_history(measured: Measured, path: Path = HISTORY) -> None:
    """Write the row of this version, in the place of one that is there: a row per release."""
    rows = history(path)
    kept = {"version": measured.version, "date": measured.date, "machine": measured.machine}
    kept |= {name: figure.row[1] for name, figure in measured.figures.items()}
    rows = [row for row in rows if row["version"] != measured.version] + [kept]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns, restval="", lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def history(path: Path = HISTORY) -> list[dict[str, str]]:
    """Return a row per release, the oldest first."""
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))
