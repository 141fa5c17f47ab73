"""One table of how accurate the paper's 57 runs are: a row for each case, from the accuracy.csv of `--accuracy`.

Counted are the end values of stress and strain in nucleus, nucleoplasm, lamina and cell (largest and mean); beside them
all numbers that a result has. An error is relative to |q - q0|; a J within 1e-4 of rest may be off by 1e-6.

    python benchmarks/accuracy_table.py [--results results] [--out results/accuracy]

Writes accuracy.csv and accuracy.md, and exits with 1 if an end value that counts is beyond 1 %.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from cellmech.results.records import to_csv, write_whole

STUDIES = ("fig2", "fig4", "fig6", "fig7")
REGIONS = ("nucleus", "nucleoplasm", "lamina", "cell")
QUANTITIES = tuple(f"{q}_{kind}" for q in ("sigma_mises", "J1", "J2", "J3") for kind in ("max", "mean"))


def counts(scalar: str) -> bool:
    """Whether a number is an end value of stress or strain in a region that the figures show."""
    region, _, name = scalar.partition(".")
    return region in REGIONS and name.removesuffix("_Pa") in QUANTITIES


def row_of(study: str, case: str, scalars: Iterable[Mapping[str, str]]) -> dict[str, Any]:
    """A case's row: end values, how many are beyond 1 %, the worst and its error; the same of all numbers.

    Args:
        study, case: their names.
        scalars: the rows of its accuracy.csv.
    """
    rows = list(scalars)
    shown = [row for row in rows if counts(row["scalar"])]
    far = [row for row in shown if float(row["error_percent"] or 0.0) > 0.0]
    far = [row for row in far if abs(float(row["value"]) - float(row["rest"])) >= 1e-4 or row["rest"] == "0.0"]
    worst = max(far, key=lambda row: float(row["error_percent"]))
    others = [row["scalar"] for row in rows if row["within_1_percent"] != "true" and not counts(row["scalar"])]
    return {
        "study": study,
        "case": case,
        "end_values": len(shown),
        "beyond_1_percent": sum(row["within_1_percent"] != "true" for row in shown),
        "worst": worst["scalar"],
        "error_percent": float(f"{float(worst['error_percent']):.2g}"),
        "all_numbers": len(rows),
        "others_beyond": ", ".join(others),
    }


def table(results: Path) -> list[dict[str, Any]]:
    """The rows of every case that has an accuracy.csv below the studies' folders."""
    rows = []
    for study in STUDIES:
        for path in sorted((results / study).glob("*/accuracy.csv")):
            with path.open(newline="") as file:
                rows.append(row_of(study, path.parent.name, csv.DictReader(file)))
    return rows


def markdown(rows: list[dict[str, Any]]) -> str:
    """The table for people, without the names of the other numbers."""
    heads = ("study", "case", "end values", "beyond 1 %", "worst", "its error, %", "all numbers", "others beyond")
    lines = [" | ".join(heads), " | ".join("---" for _ in heads)]
    for row in rows:
        others = len(row["others_beyond"].split(", ")) if row["others_beyond"] else 0
        lines.append(" | ".join(map(str, [*list(row.values())[:-1], others])))
    return "\n".join(f"| {line} |" for line in lines) + "\n"


def main() -> int:
    """Print and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--out", type=Path, default=Path("results/accuracy"))
    arguments = parser.parse_args()
    rows = table(arguments.results)
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_whole(arguments.out / "accuracy.csv", to_csv(rows))
    write_whole(arguments.out / "accuracy.md", markdown(rows))
    beyond = sum(row["beyond_1_percent"] for row in rows)
    print(markdown(rows))
    print(f"{len(rows)} cases, {sum(row['end_values'] for row in rows)} end values, {beyond} beyond 1 %")
    return int(beyond > 0 or not rows)


if __name__ == "__main__":
    sys.exit(main())
