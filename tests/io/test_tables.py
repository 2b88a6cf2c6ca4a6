"""CSV files as spreadsheets, pandas and laboratory programs write them: read right, or refused.

Every layout is read as a signal and as a table, with the same verdict.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pandas
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drake_racket.identify.ball.impacts import read_ball_impacts
from drake_racket.identify.strings.angle_table import read_angles
from drake_racket.identify.strings.restitution_table import read_restitution
from drake_racket.io import csv_text
from drake_racket.io.errors import InputError
from drake_racket.io.signals import read_signal
from drake_racket.io.tables import CsvTable
from drake_racket.io.units import convert, unit_of

TIME = [0.0005 * i for i in range(40)]
FORCE = [round(1234.5 * np.sin(np.pi * t / 0.02), 3) - 0.25 for t in TIME]


def lines(separator: str = ",", mark: str = ".", header: str = "time [s]|force [N]") -> list[str]:
    """The pulse with 7 and 4 decimals; `|` separates the header's cells, and more of them stay."""
    rows = ((f"{t:.7f}", f"{f:.4f}") for t, f in zip(TIME, FORCE, strict=True))
    more = [""] * (header.count("|") - 1)
    cells = ([c.replace(".", mark) for c in row] + more for row in rows)
    return [header.replace("|", separator), *(separator.join(row) for row in cells)]


def end(rows: Iterable[str], with_: str = "\n") -> str:
    return "".join(row + with_ for row in rows)


def rows_changed(change: Callable[[str], str]) -> str:
    head, *rows = lines()
    return end([head, *map(change, rows)])


def quoted(row: str) -> str:
    return ",".join(f'"{cell}"' for cell in row.split(","))


READ: dict[str, str | bytes] = {
    "plain": end(lines()),
    "carriage return and line feed": end(lines(), "\r\n"),
    "carriage returns of an old Macintosh": end(lines(), "\r"),
    "without an end of the last line": end(lines()).rstrip("\n"),
    "byte order mark": "\ufeff" + end(lines()),
    "Unicode text of Excel": end(lines("\t"), "\r\n").encode("utf-16"),
    "UTF-16, high byte first": "\ufeff".encode("utf-16-be") + end(lines()).encode("utf-16-be"),
    "Windows-1252": end([lines()[0] + ",note", *(r + ",21 °C µ" for r in lines()[1:])]).encode(
        "cp1252"
    ),
    "semicolons, decimal commas": end(lines(";", ",")),
    "semicolons, decimal points": end(lines(";")),
    "tabs": end(lines("\t")),
    "tabs, decimal commas": end(lines("\t", ",")),
    "Excel's line of the separator": "sep=;\n" + end(lines(";", ",")),
    "the same, in capitals and quotes": '"SEP=;"\r\n' + end(lines(";", ","), "\r\n"),
    "separator of a unit": end(lines(";", ",", "time [s]|force [N]|rate [1,s]")),
    "quoted cells": end(map(quoted, lines())),
    "quoted cells of several lines": end(
        [lines()[0] + ",note", *(r + ',"a,\nb"' for r in lines()[1:])]
    ),
    "capitals": end(lines(header="TIME [S]|Force [N]")),
    "round brackets": end(lines(header="time (s)|force (N)")),
    "no blank before the unit": end(lines(header="time[s]|force[N]")),
    "header of two lines": end(lines(header='"time\n[s]"|"force\n[N]"')),
    "a row of units in brackets": end(["time,force", "[s],[N]", *lines()[1:]]),
    "a row of bare units": end(["time,force,other", "s,N,mV", *(r + ",1" for r in lines()[1:])]),
    "a row of units below units": end([lines()[0], "s,N", *lines()[1:]]),
    "seconds spelled out": end(lines(header="time [seconds]|force [newton]")),
    "comments": "# strike 4; 20 kHz\n  # racket, B\n" + end(lines()[:5]) + "#\n" + end(lines()[5:]),
    "a separator at every end": end(row + "," for row in lines()),
    "a separator at the end of rows": end([lines()[0], *(row + ",," for row in lines()[1:])]),
    "a separator at the end of the header": end([lines()[0] + ",", *lines()[1:]]),
    "blanks around": rows_changed(lambda row: "  " + row.replace(",", "  ,\t ") + " "),
    "blank lines": end(lines(), "\n\n \n"),
    "lines of separators": ",,\n" + end(lines()) + ",\n,,\n",
    "index of pandas": end(["," + lines()[0], *(f"{i},{r}" for i, r in enumerate(lines()[1:]))]),
    "an empty column": end(lines(header="time [s]|force [N]|remark")),
    "Fortran's exponents": rows_changed(lambda row: re.sub(r"(,.*)", r"\1D+00", row)),
    "exponents": rows_changed(lambda row: re.sub(r"(,.*)", r"\1E+00", row)),
    "a minus sign of typography": rows_changed(lambda row: row.replace("-", "\u2212")),
    "padded with NUL": end(lines()) + "\0" * 512,
    "padded with Ctrl-Z": end(lines(), "\r\n") + "\x1a\0",
    "force in V as well": end([lines()[0] + ",force [V]", *(r + ",0.1" for r in lines()[1:])]),
}


def both(path: Path) -> list[tuple[np.ndarray, np.ndarray] | str]:
    """What `read_signal` and `CsvTable` make of a file: time and force, or the message."""

    def table() -> tuple[np.ndarray, np.ndarray]:
        found = CsvTable.read(path, 1000)
        return found.numbers("time", "s"), found.numbers("force", "N")

    def signal() -> tuple[np.ndarray, np.ndarray]:
        found = read_signal(path, "force", "N")
        return found.time, found.value

    results: list[tuple[np.ndarray, np.ndarray] | str] = []
    for read in (signal, table):
        try:
            results.append(read())
        except InputError as error:
            results.append(str(error))
    return results


def write(path: Path, content: str | bytes) -> Path:
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize("layout", READ)
def test_layouts_that_are_read(tmp_path: Path, layout: str) -> None:
    for found in both(write(tmp_path / "s.csv", READ[layout])):
        assert not isinstance(found, str), found
        np.testing.assert_array_equal(found[0], np.round(TIME, 7))
        np.testing.assert_array_equal(found[1], np.round(FORCE, 4))


CONVERTED = {
    "ms and kN": ("time [ms]|force [kN]", 1e-3, 1e3),
    "microseconds": ("time [µs]|force [N]", 1e-6, 1.0),
    "us": ("time (us)|force (mN)", 1e-6, 1e-3),
}


@pytest.mark.parametrize("layout", CONVERTED)
def test_multiples_are_converted(tmp_path: Path, layout: str) -> None:
    header, of_time, of_force = CONVERTED[layout]
    for found in both(write(tmp_path / "s.csv", end(lines(header=header)))):
        assert not isinstance(found, str), found
        np.testing.assert_allclose(found[0], np.array(TIME) * of_time, rtol=4e-16)
        np.testing.assert_allclose(found[1], np.array(FORCE) * of_force, rtol=4e-16)


def changed(number: int, cell: str) -> str:
    """The force of line `number` is another text."""
    rows = lines()
    rows[number - 1] = rows[number - 1].split(",")[0] + "," + cell
    return end(rows)


def commas(row: str) -> str:
    return row.replace(",", ";").replace(".", ",")


LABVIEW = ["LabVIEW Measurement\t", "Separator\tTab", "***End_of_Header***\t", ""]
DEWESOFT = ["Data file: strike_04.d7d", "Sample rate: 2000 Hz", ""]
NAMES = "abs time,Fx,Fy,Fz"
REFUSED: dict[str, tuple[str | bytes, list[str]]] = {
    "thousands": (changed(7, '"1,003.429"'), ["row 7, force [N]", "'1,003.429'", "thousands"]),
    "thousands with blanks": (changed(7, "1 003.429"), ["row 7", "thousands"]),
    "thousands with apostrophes": (changed(7, "1'003.429"), ["row 7", "thousands"]),
    "thousands of Germany": (
        end([*lines(";", ",")[:6], "0,01;1.234,5", *lines(";", ",")[7:]]),
        ["row 7, force [N]", "'1.234,5'", "thousands"],
    ),
    "commas in thousands": (
        "time [s];force [N]\n" + end(f"{i};1,{i:03d}" for i in range(40)),
        ["row 2, force [N]", "'1,000'", "decimal comma, or a comma before thousands"],
    ),
    "decimal commas between commas": (
        end([lines()[0], *(row.replace(".", ",") for row in lines()[1:])]),
        ["row 2", "'4 cells: 0,0000000,-0,2500'", "2 cells", "decimal commas"],
    ),
    "a quoted decimal comma": (changed(7, '"12,5"'), ["row 7", "'12,5'", "decimal comma"]),
    "points and commas": (
        end([*map(commas, lines()[:9]), *(r.replace(",", ";") for r in lines()[9:])]),
        ["row 10, time [s]", "one decimal mark", "decimal point"],
    ),
    "tabs below commas": (
        end([lines()[0], *lines("\t")[1:]]), ["row 2", "tabs separate this row, commas the header"],
    ),
    "separators mixed": (
        end(["time [s],\tforce [N]", *(r.replace(",", ",\t") for r in lines()[1:])]),
        ["row 1", "one of commas, semicolons, tabs"],
    ),
    "another separator": ("sep=|\n" + end(lines("|")), ["row 1", "'|'", "sep="]),
    "a preamble of LabVIEW": (
        end([*LABVIEW, *lines("\t", header="time [s]|force [N]|Comment")]),
        ["row 1", "LabVIEW Measurement", "seems to be row 5", "remove the lines above"],
    ),
    "a preamble of Dewesoft": (
        end([*DEWESOFT, *lines(";", ",")]),
        ["row 1", "Data file: strike_04.d7d", "seems to be row 4"],
    ),
    "a preamble as wide as the table": (
        end(["strike,4", *lines()]),
        ["header: got 'strike, 4'", "row 2 seems to be the header"],
    ),
    "names of BioWare": (
        end([NAMES, "s,N,N,N", *(r + ",0,0" for r in lines()[1:])]),
        ["'abs time [s], Fx [N], Fy [N], Fz [N]'", "a column time [s]"],
    ),
    "no header": (end(lines()[1:]), ["a column time [s]", "is the header"]),
    "a header behind #": ("# " + end(lines()), ["a column time [s]", "no comment"]),
    "a row of units that contradicts": (
        end([lines()[0], "ms,N", *lines()[1:]]), ["row 2, time [s]", "'ms'", "the header has"],
    ),
    "units nobody knows": (end(["time,force", "s,LSB", *lines()[1:]]), ["'time'", "time [s]"]),
    "a unit in a cell": (changed(7, "12.5 N"), ["row 7", "'12.5 N'", "unit in the header"]),
    "a unit alone": (changed(7, "N"), ["row 7", "'N'", "a unit"]),
    "volts": (end(lines(header="time [s]|force [V]")), ["'force [V]'", "force [N] (or in kN, mN)"]),
    "minutes": (end(lines(header="time [min]|force [N]")), ["'time [min]'", "in ms, us"]),
    "no unit": (end(lines(header="time|force [N]")), ["'time'", "a column time [s]"]),
    "a column twice": (
        end([lines()[0] + ",Force [N]", *(r + ",1" for r in lines()[1:])]), ["force [N] twice"],
    ),
    "an overload": (changed(7, "OVL"), ["row 7, force [N]", "'OVL'", "an overload"]),
    "no number": (changed(7, "n/a"), ["row 7", "'n/a'", "text in a column of numbers"]),
    "nan": (changed(7, "nan"), ["row 7", "'nan'", "a finite number"]),
    "too large": (changed(7, "1e999"), ["row 7", "1e999", "a finite number"]),
    "other digits": (changed(7, "٣"), ["row 7", "a finite number"]),
    "an underscore": (changed(7, "1_000"), ["row 7", "1_000"]),
    "an empty cell": (changed(7, ""), ["row 7", "''", "empty"]),
    "a footer": (end([*lines(), "END OF DATA"]), ["row 42", "END OF DATA", "below the numbers"]),
    "a row of means": (end([*lines(), "mean,3"]), ["row 42, time [s]", "'mean'", "text"]),
    "a footer below a row of text": (
        end(["time,force", "s,LSB", *lines()[1:], "END"]), ["row 43", "'1 cells: END'", "2 cells"],
    ),
    "cut off": (end([*lines(), "0.02"]), ["row 42", "'1 cells: 0.02'", "2 cells"]),
    "a cell too many": (end([*lines(), "1,2,3,4,5"]), ["row 42", "'5 cells: 1,2,3,4,5'"]),
    "an open quote": (end([*lines(), '1,"2']), ["row 42", "CSV, with quotes that close"]),
    "text behind a quote": (end([*lines(), '1,"2"3', "4,5"]), ["row 42", "CSV"]),
    "no rows": (lines()[0], ["no rows"]),
    "only a row of units": ("time,force\ns,N\n", ["no rows"]),
    "nothing": ("# only this\n\n", ["an empty file"]),
    "names of nothing": ("\xa0\n1\n", ["row 1", "names of columns"]),
    "UTF-16 without its mark": (end(lines()).encode("utf-16-le"), ["row 1", "UTF-16"]),
    "half of UTF-16": (b"\xff\xfet\0i", ["not UTF-8 text"]),
    "NUL within": (changed(7, "1\x002"), ["row 7", "control character"]),
    "a workbook": (b"PK\x03\x04" + bytes(200), ["workbook", "save as CSV"]),
    "bytes": (bytes(range(256)), ["CSV file"]),
}  # fmt: skip


@pytest.mark.parametrize("layout", REFUSED)
def test_layouts_that_are_refused(tmp_path: Path, layout: str) -> None:
    content, words = REFUSED[layout]
    as_signal, as_table = both(write(tmp_path / "odd.csv", content))
    assert isinstance(as_signal, str), as_signal
    assert as_signal == as_table
    assert as_signal.isprintable()
    assert "odd.csv" in as_signal
    assert len(as_signal) < 600
    assert all(word in as_signal for word in words), as_signal


def test_too_large_files_end_early(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "s.csv", end(lines()))
    size = path.stat().st_size
    assert len(CsvTable.read(path, 40, size).lines) == 40
    with pytest.raises(InputError, match=f"at most {size - 1} bytes"):
        CsvTable.read(path, 40, size - 1)
    with pytest.raises(InputError, match="rows: got 40; allowed: at most 39"):
        CsvTable.read(path, 39)
    with pytest.raises(InputError, match="a larger file"):
        CsvTable.read(Path("/dev/zero"), 40)
    monkeypatch.setattr(csv_text, "MOST_LINES", 41)
    assert len(CsvTable.read(path, 40).lines) == 40
    with pytest.raises(InputError, match=r"42 lines.*at most 41"):
        CsvTable.read(write(path, "#\n" + end(lines())), 40)


def test_a_row_keeps_its_line_number(tmp_path: Path) -> None:
    text = '# why\nsep=;\n\nname;mass [g]\n"two\nlines";1\n\n# no\nb;2,5\n"c";x\n'
    path = write(tmp_path / "t.csv", text)
    # a comment is what begins with #, before the line that names the separator, too
    table = CsvTable.read(path, 9)
    assert table.lines == (5, 9, 10)
    assert table.texts("NAME") == ["two\nlines", "b", "c"]
    assert table.at(1, "mass") == f"{path}: row 9, mass"
    with pytest.raises(InputError, match=r"row 10, mass \[g\]: got 'x'"):
        table.numbers("mass", "kg")
    np.testing.assert_array_equal(table.where_text("name", "b").numbers("mass", "kg"), [0.0025])


def test_a_decimal_point_that_a_selection_brings_up_is_no_comma(tmp_path: Path) -> None:
    text = "tension;mass [g];speed [m/s]\nlow;lost;0,5\nhigh;1.234;0,5\n"
    table = CsvTable.read(write(tmp_path / "t.csv", text), 9).where_text("tension", "high")
    with pytest.raises(InputError, match=r"row 3, mass \[g\]: got '1.234'.*decimal point"):
        table.numbers("mass", "kg")


def test_any_text_that_is_quoted_comes_back_from_pandas(tmp_path: Path) -> None:
    notes = ["a,b", 'say "so"', "x;y", "µ°", "n#1", "two\nlines", "-"]
    frame = pandas.DataFrame(
        {"note": notes, "Approach speed [m/s]": np.linspace(1.0, 2.0, 7) / 3.0}
    )
    for options in ({}, {"sep": ";", "decimal": ","}, {"sep": "\t", "index": False}):
        frame.to_csv(tmp_path / "t.csv", **options)
        table = CsvTable.read(tmp_path / "t.csv", 9)
        assert table.texts("note") == notes
        np.testing.assert_array_equal(
            table.numbers("approach_speed", "m/s"), frame["Approach speed [m/s]"]
        )


NUMBERS = st.lists(st.floats(-1e9, 1e9), min_size=3, max_size=9)


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(
    values=NUMBERS,
    separator=st.sampled_from(",;\t"),
    comma=st.booleans(),
    shape=st.sampled_from([".17g", ".6f", ".9E", "+.3f", ".2f"]),
)
def test_any_numbers_are_read_right_or_refused(tmp_path, values, separator, comma, shape) -> None:
    cells = [format(value, shape) for value in values]
    shown = [cell.replace(".", ",") if comma else cell for cell in cells]
    rows = [f"time [s]{separator}force [N]", *(f"{i}{separator}{c}" for i, c in enumerate(shown))]
    path = write(tmp_path / "t.csv", end(rows))
    # a whole column of 1,234 with semicolons may be thousands; with commas it is two cells
    maybe = all(re.fullmatch(r"[+-]?[1-9]\d{0,2},\d{3}|[+-]?\d+", cell) for cell in shown)
    if any("," in cell for cell in shown) and (separator == "," or maybe):
        with pytest.raises(InputError, match=r"cells|thousands"):
            CsvTable.read(path, 9).numbers("force", "N")
    else:
        found = CsvTable.read(path, 9).numbers("force", "N")
        assert found.tolist() == [float(cell) for cell in cells]


# --- units ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given_unit", "wanted", "factor"),
    [
        ("ms", "s", 1e-3), ("us", "s", 1e-6), ("mm", "m", 1e-3), ("cm", "m", 1e-2),
        ("kN", "N", 1e3), ("mN", "N", 1e-3), ("g", "kg", 1e-3), ("km/h", "m/s", 1.0 / 3.6),
        ("mm/s", "m/s", 1e-3), ("mm/s^2", "m/s^2", 1e-3), ("rad", "deg", 180.0 / np.pi),
        ("N", "N", 1.0),
    ],
)  # fmt: skip
def test_factors(given_unit: str, wanted: str, factor: float) -> None:
    numbers = np.array([-7.0, 0.3, 12.5])
    np.testing.assert_allclose(convert(numbers, given_unit, wanted), factor * numbers, rtol=4e-16)


@pytest.mark.parametrize(
    ("texts", "unit"),
    [
        (("m/s^2", "m/s²", "m s^-2", "m s⁻²", "m·s⁻²", "m/s2", "m/s**2", " m/s/s "), "m/s^2"),
        (("m/s", "m s^-1", "m s⁻¹", "m·s^-1"), "m/s"),
        (("µs", "μs", "us"), "us"),
        (("", " ", "-", "1", "\u2013"), "1"),
        (("°", "deg", "degrees"), "deg"),
        (("MN",), "MN"),
        (("Ms",), "Ms"),
    ],
)  # fmt: skip
def test_spellings(texts: tuple[str, ...], unit: str) -> None:
    assert {unit_of(text) for text in texts} == {unit}


@pytest.mark.parametrize(
    ("name", "unit", "wanted"),
    [
        ("mass", "mg", "kg"), ("mass", "KG m", "kg"), ("force", "MN", "N"), ("force", "KN", "N"),
        ("time", "MS", "s"), ("acceleration", "g", "m/s^2"), ("restitution", "%", "1"),
        ("speed", "mph", "m/s"), ("speed", "", "m/s"),
    ],
)  # fmt: skip
def test_units_that_are_no_plain_multiple_are_refused(tmp_path, name, unit, wanted) -> None:
    path = write(tmp_path / "t.csv", f"{name} [{unit}],b\n1,2\n")
    shown = re.escape(f"header: got '{name} [{unit}]'; allowed: a column {name} [{wanted}]")
    with pytest.raises(InputError, match=shown):
        CsvTable.read(path, 9).numbers(name, wanted)


# --- tables of measurements -----------------------------------------------------------------------

SHOTS = [(p, 30.0 + 0.1 * p, 0.40 + 0.01 * p) for p in range(1, 10)]


def shots(row: Callable[[int, float, float], str], header: str = "") -> str:
    head = header or "point,approach_speed [m/s],restitution"
    return end([head, *(row(*shot) for shot in SHOTS)])


TABLES: dict[str, str] = {
    "plain": shots(lambda p, v, e: f"{p},{v:.1f},{e:.2f}"),
    "floats": shots(lambda p, v, e: f"{p}.0,{v:.4f},{e:.6e}"),
    "a unit of one": shots(
        lambda p, v, e: f"{p},{v:.1f},{e:.2f}", "point [1],approach_speed [m s^-1],restitution [-]"
    ),
    "a spreadsheet's names": shots(
        lambda p, v, e: f"{p};{v:.1f};{e:.2f}".replace(".", ","),
        "Point;Approach speed (m/s);Restitution",
    ),
    "km/h": shots(
        lambda p, v, e: f"{p},{3.6 * v:.6f},{e:.2f}", "point,approach_speed [km/h],restitution"
    ),
    "empty rows": shots(lambda p, v, e: f"{p},{v:.1f},{e:.2f}") + ",,\n,,\n",
    "a row of units": shots(
        lambda p, v, e: f"{p},{v:.1f},{e:.2f}", "point,approach_speed,restitution\n-,m/s,-"
    ),
    "mm/s": shots(
        lambda p, v, e: f"{p},{v:.1f},{1000 * v * e:.3f}",
        "point,approach_speed [m/s],rebound_speed [mm/s]",
    ),
}


@pytest.mark.parametrize("layout", TABLES)
def test_tables_of_restitution(tmp_path: Path, layout: str) -> None:
    found = read_restitution(write(tmp_path / "t.csv", TABLES[layout]))
    points, speeds, restitution = np.array(SHOTS).T
    assert found.points.tolist() == points.tolist()
    np.testing.assert_allclose(found.speeds, speeds, rtol=1e-8)
    np.testing.assert_allclose(found.restitution, restitution, rtol=1e-6)


def fourth(cell: str) -> str:
    return shots(lambda p, v, e: f"{p},{v:.1f},{cell if p == 4 else f'{e:.2f}'}")


BAD_TABLES: dict[str, tuple[str, str]] = {
    "per cent": (
        shots(lambda p, v, e: f"{p},{v},{100 * e}", "point,approach_speed [m/s],restitution [%]"),
        r"restitution \[%\]'; allowed: a column restitution \[1\]",
    ),
    "letters": (shots(lambda p, v, e: f"P{p},{v},{e}"), "row 2, point: got 'P1'.*text"),
    "means": (TABLES["plain"] + "mean,30.5,0.45\n", "row 11, point: got 'mean'.*begin it with #"),
    "a lost shot": (fourth(""), "row 5, restitution: got ''.*empty"),
    "a shot marked as lost": (fourth("NA"), "row 5, restitution: got 'NA'.*text"),
    "rebound below zero": (
        shots(lambda p, v, e: f"{p},{v},{-v * e}", "point,speed [m/s],rebound_speed [m/s]"),
        "row 2, restitution: got -0.41",
    ),
    "approach below zero": (
        shots(lambda p, v, e: f"{p},{-v},{e}"),
        "row 2, approach_speed: got -30",
    ),
    "a contradiction": (
        shots(
            lambda p, v, e: f"{p},{v},{e},{v * e + 3.0}",
            "point,approach_speed [m/s],restitution,rebound_speed [m/s]",
        ),
        "row 2, restitution: got 0.41.*rebound over approach speed",
    ),
    "a shot twice": (TABLES["plain"] + "9,30.9,0.49\n", "row 11.*row 10.*repeat"),
}


@pytest.mark.parametrize("layout", BAD_TABLES)
def test_tables_of_restitution_that_are_refused(tmp_path: Path, layout: str) -> None:
    text, words = BAD_TABLES[layout]
    with pytest.raises(InputError, match=words) as caught:
        read_restitution(write(tmp_path / "t.csv", text))
    assert str(caught.value).isprintable()


def test_angles_in_radians_and_impacts_in_other_units(tmp_path: Path) -> None:
    head = "point,approach speed (km/h),incidence [rad],rebound_angle [rad]"
    angles = read_angles(write(tmp_path / "a.csv", f"{head}\n5,72,1.2,1.0\n"))
    assert (angles.speeds[0], angles.incidence[0]) == pytest.approx((20.0, np.degrees(1.2)))
    assert angles.angle[0] == np.degrees(1.0)
    write(tmp_path / "r.csv", end(lines(";", ",", "time (ms)|force (kN)")))
    table = write(tmp_path / "i.csv", "File;Speed [km/h];Mass [g]\nr.csv;64,8;57,7\n")
    (impact,) = read_ball_impacts(table)
    assert (impact.speed, impact.mass) == pytest.approx((18.0, 0.0577), rel=1e-15)
    assert impact.force.value.max() == pytest.approx(1e3 * max(FORCE), rel=1e-15)


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("time [s],force; filtered [N]", "0.1,2.5"),
        ("time [s];force, filtered [N]", "0.1;2.5"),
        ("time [s]\tforce, left; filtered [N]", "0.1\t2.5"),
    ],
)
def test_a_header_with_several_separators_is_cut_as_its_row_is(tmp_path, header, row) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"{header}\n{row}\n{row}\n")
    assert csv_text.read_csv_text(path, 1000).separator == row[3]
